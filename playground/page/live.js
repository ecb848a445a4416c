// A run whose only frame is the present moment, as numbers of the program (`frame.rs`).

const HEAD = 20;
const OF_BODY = 7;
const OF_CONTACT = 15;

class LiveRun extends Run {
  constructor(film) {
    super(film, 0);
    // Poses of the film, until there is a moment.
    this.start = this.bodies.map((_, body) => ({
      place: super.position(0, body),
      attitude: super.attitude(0, body),
    }));
    // The present moment is not the last row.
    this.count = 2;
    // A heap of many bodies has its arrows in front.
    this.mostTests = 3e5;
    // Bodies may be thrown farther than the start shows.
    this.roam = 5;
    this.numbers = null;
  }

  // Shows a moment. It has as many bodies as the film.
  show(numbers) {
    this.numbers = numbers;
  }

  get contactStart() {
    return HEAD + OF_BODY * this.bodies.length;
  }

  frame() {
    return 0;
  }

  position(frame, body) {
    if (this.numbers === null) return this.start[body].place;
    const at = HEAD + OF_BODY * body;
    return [this.numbers[at], this.numbers[at + 1], this.numbers[at + 2]];
  }

  attitude(frame, body) {
    if (this.numbers === null) return this.start[body].attitude;
    const at = HEAD + OF_BODY * body + 3;
    return [0, 1, 2, 3].map((part) => this.numbers[at + part]);
  }

  // Contacts with a force.
  forces() {
    if (this.numbers === null) return [];
    const { numbers } = this;
    const found = [];
    for (let at = this.contactStart; at + OF_CONTACT <= numbers.length; at += OF_CONTACT) {
      const vector = (place) => Array.from(numbers.subarray(at + place, at + place + 3));
      found.push({
        site: found.length,
        body: numbers[at],
        partner: numbers[at + 1],
        point: vector(2),
        normal: vector(5),
        force: vector(8),
        slip: vector(11),
        friction: numbers[at + 14],
      });
    }
    return found;
  }
}

// Head of a moment.
function headOf(numbers) {
  const [index, time, status, residual, kinetic, total, iterations, failed, wild, first, worst] = numbers;
  const [, , , , , , , , , , , bodies, , grabbed] = numbers;
  const place = Array.from(numbers.subarray(14, 17));
  const target = Array.from(numbers.subarray(17, 20));
  return {
    index, time, status, residual, kinetic, total, iterations, failed, wild, first, worst, bodies,
    grabbed, place, target,
  };
}
