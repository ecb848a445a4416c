// Names at bodies. They follow the bodies and give way to nearer and chosen ones.

// Maximum number of names.
const MOST_NAMES = 150;
// Distance of a name from its body, and smallest gap between names (pixels).
const NAME_LIFT = 6;
const NAME_GAP = 2;

class Labels {
  constructor() {
    this.place = element("div", { class: "names", "aria-hidden": "true" });
    this.known = new Map();
  }

  // Shows `names`: body, text, whether it is chosen, and position in the picture with distance.
  show(names, [width, height]) {
    const wanted = new Set(names.map(({ body }) => body));
    for (const [body, label] of this.known) {
      if (wanted.has(body)) continue;
      label.remove();
      this.known.delete(body);
    }
    // Chosen names first, then nearer ones.
    const ordered = [...names].sort((a, b) => b.isChosen - a.isChosen || a.distance - b.distance);
    const taken = [];
    for (const { body, text, isChosen, x, y } of ordered) {
      const label = this.known.get(body) ?? this.make(body);
      put(label, text);
      label.classList.toggle("chosen", isChosen);
      // Layout is only measured if the text is new.
      if (label.measured !== text) {
        Object.assign(label, { measured: text, wide: label.offsetWidth, high: label.offsetHeight });
      }
      const [wide, high] = [label.wide, label.high];
      const box = { left: x - wide / 2, top: y - NAME_LIFT - high, wide, high };
      const isInside = x >= 0 && x <= width && y >= 0 && y <= height + high;
      const isFree = () => taken.every((other) => !overlap(box, other));
      // A chosen name moves up instead of giving way.
      for (let k = 0; isChosen && k < taken.length && !isFree(); k += 1) box.top -= high + NAME_GAP;
      const isShown = isInside && isFree();
      label.style.visibility = isShown ? "visible" : "hidden";
      if (!isShown) continue;
      // A name at the rim stays in the picture.
      box.left = Math.min(Math.max(box.left, 2), Math.max(2, width - wide - 2));
      box.top = Math.max(box.top, 2);
      label.style.transform = `translate(${box.left.toFixed(1)}px, ${box.top.toFixed(1)}px)`;
      taken.push(box);
    }
  }

  make(body) {
    const label = element("span");
    this.known.set(body, label);
    this.place.append(label);
    return label;
  }
}

function overlap(a, b) {
  const apart = (from, size) =>
    a[from] > b[from] + b[size] + NAME_GAP || b[from] > a[from] + a[size] + NAME_GAP;
  return !apart("left", "wide") && !apart("top", "high");
}
