// The package in Node.js.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { before, test } from "node:test";
import { init, Simulation } from "tumble-sim";
import { bits, contactOf, contactsOf, scene, stateNumbers, tables } from "./support.js";

before(() => init());

const STACK = `
steps = 100
[ground]
friction = 0.5
[[bodies]]
name = "low"
box = 0.2
mass = 1.0
position = [0.0, 0.0, 0.1]
[[bodies]]
name = "high"
box = 0.2
mass = 1.0
position = [0.0, 0.0, 0.3]
`;

// All steps of a scene against the tables of the command line.
function compare(name, steps) {
  const reference = tables(name, steps);
  const simulation = new Simulation(scene(name));
  const bodies = simulation.bodies.length;
  assert.equal(reference.states.length, (steps + 1) * bodies);
  for (let k = 0; k <= steps; k += 1) {
    if (k > 0) {
      simulation.step();
      const { certificate } = simulation;
      const row = reference.steps[k - 1];
      assert.equal(certificate.status, row.status);
      assert.equal(certificate.iterations, Number(row.iterations));
      assert.equal(certificate.residual, Number(row.residual_m_s));
      assert.equal(certificate.dynamics, Number(row.dynamics_m_s));
      assert.equal(certificate.frictionLaw, Number(row.friction_law_m_s));
      const found = simulation.contacts.map(({ friction, ...contact }) => contact);
      const rows = contactsOf(reference, k - 1).map(contactOf);
      // The table also has contacts with a negative gap and no force.
      assert.deepEqual(found, rows.filter(({ force }) => force.some((part) => part !== 0)));
    }
    const rows = reference.states.slice(k * bodies, (k + 1) * bodies);
    assert.deepEqual(bits(simulation.states), bits(rows.flatMap(stateNumbers)), `step ${k}`);
    // At the start the table has velocities that the first step computes.
    if (k > 0) assert.equal(simulation.energy, Number(reference.steps[k].energy_J));
    assert.equal(simulation.time, Number(rows[0].time_s));
  }
  assert.equal(simulation.index, steps);
}

test("999 steps of drop have the bits of the command line", () => compare("drop", 999));

for (const [name, steps] of [["arch", 60], ["double-pendulum", 300], ["galton", 150]]) {
  test(`${name} has the bits of the command line`, () => compare(name, steps));
}

test("several simulations do not disturb each other", () => {
  const [one, other] = [new Simulation(scene("drop")), new Simulation(STACK)];
  const alone = new Simulation(scene("drop")).step(300);
  for (let k = 0; k < 300; k += 1) {
    one.step();
    other.step();
  }
  assert.deepEqual(bits(one.states), bits(alone.states));
  assert.deepEqual(other.bodies, ["low", "high"]);
});

test("a stack rests, and its contacts carry it", () => {
  const simulation = new Simulation(STACK);
  assert.equal(simulation.certificate, null);
  assert.deepEqual(simulation.contacts, []);
  const start = simulation.states;
  assert.equal(simulation.step(50), simulation);
  assert.equal(start[2], 0.1);
  const { certificate, contacts } = simulation;
  assert.ok(certificate.converged && certificate.residual < 1e-9, JSON.stringify(certificate));
  assert.deepEqual(simulation.unsolved, { failed: 0, wild: 0, first: null });
  const weight = contacts.filter(({ partner }) => partner === "ground").reduce((sum, { force }) => sum + force[2], 0);
  assert.ok(Math.abs(weight - 2 * 9.81) < 1e-6, String(weight));
  assert.ok(contacts.some(({ partner }) => partner === "body"));
  assert.ok(contacts.every(({ friction }) => friction === 0.5));
  const { position, attitude } = simulation.state("high");
  assert.ok(Math.abs(position[2] - 0.3) < 1e-6);
  assert.equal(attitude.length, 4);
  assert.deepEqual(simulation.state(1), simulation.state("high"));
  const { bodies, ground } = simulation.drawing;
  assert.deepEqual(ground, { normal: [0, 0, 1], offset: 0 });
  assert.equal(bodies[0].pieces[0].faces.length, 6);
});

test("the scenes of the example and of README.md are solved", () => {
  for (const file of ["examples/three.html", "README.md"]) {
    const text = readFileSync(new URL(`../${file}`, import.meta.url), "utf8");
    const [, example] = /new Simulation\(`([^`]*)`/.exec(text);
    const simulation = new Simulation(example).step(200);
    assert.equal(simulation.unsolved.first, null, file);
    assert.deepEqual(simulation.notes, []);
  }
});

test("a step back is exact", () => {
  const simulation = new Simulation(scene("drop")).step(250);
  const before = bits(simulation.states);
  simulation.step(20);
  while (simulation.index > 250) simulation.back();
  assert.deepEqual(bits(simulation.states), before);
  assert.throws(() => new Simulation(STACK).back(), /no earlier step/);
});

test("faults are sentences", () => {
  assert.throws(() => new Simulation("steps = 3\n[ground]\nfriction = 0.5\n[[bodies]]\nbocks = 1.0\n"), /^Error: scene: .*bocks/);
  const mesh = STACK.replace("box = 0.2", 'mesh = "part.stl"');
  assert.throws(() => new Simulation(mesh), /part\.stl.*write the shape into the scene/);
  assert.throws(() => new Simulation(undefined), TypeError);
  const simulation = new Simulation(STACK);
  for (const count of [-1, 0.5, NaN, 2 ** 32, "3"]) assert.throws(() => simulation.step(count), RangeError);
  for (const body of ["none", 2, -1]) assert.throws(() => simulation.state(body), RangeError);
  simulation.free();
  assert.throws(() => simulation.step(), /was freed/);
});
