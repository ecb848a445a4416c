// Numbers as text.

const MINUS = "\u2212";
const NOTHING = "\u2013";

const raised = (exponent) =>
  String(exponent).replace(/./g, (c) =>
    c === "-" ? "\u207b" : "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[c],
  );

// A number with `digits` digits, as a power of ten where that is shorter.
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

// A number with a fixed number of decimals, so that columns do not jump; as a power of ten
// where that many would be hard to read.
function fixed(value, decimals) {
  if (!Number.isFinite(value)) return NOTHING;
  if (Math.abs(value) >= 1e6 || decimals > 9) return number(value);
  const text = value.toFixed(decimals);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", MINUS);
}

// Whole numbers, long ones with thin spaces between groups of three digits.
const count = (value) =>
  value < 1e4 ? String(value) : String(value).replace(/\B(?=(\d{3})+$)/g, "\u202f");

const th = (n) =>
  n === 1
    ? ""
    : `${n}${{ 1: "st", 2: "nd", 3: "rd" }[n % 100 > 10 && n % 100 < 14 ? 0 : n % 10] ?? "th"}`;

// The decimals that write `step` out, nine at most.
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

// The decimals with which numbers of the size of `size` have four digits.
const decimalsOf = (size) =>
  size > 0 && Number.isFinite(size) ? Math.max(0, 3 - Math.floor(Math.log10(size) + 1e-9)) : 3;

// The decimals of a time: those of the step, or three digits of it where it is no round number.
function stepDecimals(step) {
  const three = Math.max(0, 2 - Math.floor(Math.log10(step) + 1e-9));
  return decimals(step) < 9 ? Math.min(decimals(step), three) : three;
}

// The label of a tick: a power of ten on a logarithmic axis, else a multiple of `step`.
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

// An element with attributes and children; text is only ever text.
function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}
