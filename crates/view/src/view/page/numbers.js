// Formatting of numbers.

const MINUS = "\u2212";
const NOTHING = "\u2013";

const raised = (exponent) =>
  String(exponent).replace(/./g, (c) =>
    c === "-" ? "\u207b" : "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[c],
  );

// Formats `digits` significant digits, with a power of ten for very large or small numbers.
function number(value, digits = 4) {
  if (!Number.isFinite(value)) return NOTHING;
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, exponent] = value.toExponential(Math.min(digits, 3) - 1).split("e");
    return `${mantissa.replace("-", MINUS)}\u00b710${raised(Number(exponent))}`;
  }
  return value.toPrecision(digits).replace("-", MINUS);
}

// Formats a fixed number of decimals, which keeps columns stable. Very large numbers and very small
// steps use a power of ten.
function fixed(value, decimals) {
  if (!Number.isFinite(value)) return NOTHING;
  if (Math.abs(value) >= 1e6 || decimals > 9) return number(value);
  const text = value.toFixed(decimals);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", MINUS);
}

// Formats an integer. Long ones have thin spaces between groups of three digits.
const count = (value) =>
  value < 1e4 ? String(value) : String(value).replace(/\B(?=(\d{3})+$)/g, "\u202f");

const th = (n) =>
  n === 1
    ? ""
    : `${n}${{ 1: "st", 2: "nd", 3: "rd" }[n % 100 > 10 && n % 100 < 14 ? 0 : n % 10] ?? "th"}`;

// Number of decimals that represents `step`, at most nine.
function decimals(step) {
  let places = 0;
  while (
    places < 9 &&
    Math.abs(step * 10 ** places - Math.round(step * 10 ** places)) > 1e-6 * step * 10 ** places
  ) {
    places += 1;
  }
  return places;
}

// Number of decimals that yields four significant digits at magnitude `size`.
const decimalsOf = (size) =>
  size > 0 && Number.isFinite(size) ? Math.max(0, 3 - Math.floor(Math.log10(size) + 1e-9)) : 3;

// Number of decimals of a time: those of the step, at most three of its significant digits.
function stepDecimals(step) {
  const three = Math.max(0, 2 - Math.floor(Math.log10(step) + 1e-9));
  return decimals(step) < 9 ? Math.min(decimals(step), three) : three;
}

// Label of a tick: a power of ten on a logarithmic axis, else a multiple of `step`.
function tick(value, step) {
  if (value === 0) return "0";
  if (step === undefined) {
    const exponent = Math.round(Math.log10(Math.abs(value)));
    const sign = value < 0 ? MINUS : "";
    const isShort = exponent >= -3 && exponent <= 3;
    return sign + (isShort ? String(Number(`1e${exponent}`)) : `10${raised(exponent)}`);
  }
  if (Math.abs(value) >= 1e6 || step < 1e-6) {
    const [mantissa, exponent] = value.toExponential(2).split("e");
    return `${String(Number(mantissa)).replace("-", MINUS)}\u00b710${raised(Number(exponent))}`;
  }
  return fixed(value, decimals(step));
}

// SVG element with attributes.
function svg(name, attributes) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

// Element with attributes and children. Strings are inserted as text, never as markup.
function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

const put = (place, text) => {
  if (place.textContent !== text) place.textContent = text;
};
