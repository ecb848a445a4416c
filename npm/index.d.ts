/**
 * Rigid bodies in hard frictional contact. Lengths are in m, masses in kg, times in s, forces in N. Vectors are
 * in the world frame unless stated otherwise.
 *
 * ```js
 * import { init, Simulation } from "tumble-sim";
 * await init();
 * const simulation = new Simulation(toml);
 * simulation.step(100);
 * ```
 */

/** x, y, z. */
export type Vector = [number, number, number];

/** Source of the WebAssembly: an address, a response, bytes or a compiled module. */
export type Source = string | URL | Response | BufferSource | WebAssembly.Module;

/**
 * Compiles the WebAssembly. Call it once, before the first `new Simulation`. Later calls return at once.
 *
 * @param source the file `tumble.wasm` if it is not beside this module, for example at an address of a bundler
 */
export function init(source?: Source | Promise<Source>): Promise<void>;

/** State of a body at an instant. */
export interface State {
  /** Centre of mass (m). */
  position: Vector;
  /** Unit quaternion w, x, y, z from the body frame to the world frame. */
  attitude: [number, number, number, number];
  /** Velocity of the centre of mass (m/s). */
  velocity: Vector;
  /** Angular velocity (rad/s) in the body frame. */
  spin: Vector;
}

/** A contact with a force. */
export interface Contact {
  /** Index of the body. */
  body: number;
  /** Kind of the other side. */
  partner: "ground" | "fixed" | "body";
  /** Index of the other body or fixed piece; 0 for the ground. */
  partnerIndex: number;
  /** Contact point at the start of the step (m). */
  point: Vector;
  /** Unit normal, towards the body. */
  normal: Vector;
  /** Mean force on the body over the step (N). */
  force: Vector;
  /** Mean slip velocity over the step (m/s). */
  slip: Vector;
  /** Coefficient of friction. */
  friction: number;
}

/**
 * Residuals of a step in its equations (m/s), recomputed from states and forces alone. See
 * docs/concepts/certificate.md of the repository.
 */
export interface Certificate {
  /** Largest of the parts below. */
  residual: number;
  /** Equations of motion. */
  dynamics: number;
  /** Depth of the deepest penetration over the time step. */
  penetration: number;
  /** Complementarity of gap and normal force. */
  normalLaw: number;
  /** Maximum dissipation: friction opposes the slip. */
  frictionLaw: number;
  /** Friction outside the cone. */
  cone: number;
  /** Locked directions of joints. */
  joint: number;
  /** Springs, motors, limits and friction of joints. */
  jointLaw: number;
  /** Status of the step, as in `steps.csv`. */
  status: "free" | "converged" | "retried" | "fallback" | "substepped" | "wild" | "failed";
  /** False for a step that is `failed` or `wild` (unphysical). */
  converged: boolean;
  /** Iterations of the solver. */
  iterations: number;
}

/** Steps that were not solved. */
export interface Unsolved {
  /** Number of steps that did not converge. */
  failed: number;
  /** Number of unphysical steps. */
  wild: number;
  /** Index of the first of both; null if there is none. */
  first: number | null;
}

/** All points within `radius` of a polyhedron, a segment or a point. */
export interface Piece {
  /** Corners (m), in the body frame; in the world frame for fixed objects. */
  vertices: Vector[];
  /** Faces: indices of their corners, counter-clockwise from outside, and outward unit normal. */
  faces: { vertices: number[]; normal: Vector }[];
  /** Rounding radius (m); 0 for sharp edges. */
  radius: number;
}

/** Shape of a body or of a fixed object. */
export interface Shape {
  name: string;
  /** CSS colour; empty for fixed objects. */
  colour: string;
  /** Contact points (m, body frame) of a body that has points instead of pieces. */
  points: Vector[];
  /** Pieces. Those of terrain have no vertices here. */
  pieces: Piece[];
}

/** Shapes of a scene. Smooth shapes are polyhedra with many faces. */
export interface Drawing {
  bodies: Shape[];
  fixed: Shape[];
  /** Plane n · x = d of the ground; null without ground. */
  ground: { normal: Vector; offset: number } | null;
}

/** A running scene. Each has a memory of its own, so several do not disturb each other. */
export class Simulation {
  /**
   * @param scene text of a scenario file (TOML), or a URDF or SDF without meshes. The text cannot refer to other files.
   * @throws Error with the first fault of the text
   */
  constructor(scene: string);

  /**
   * Takes `count` steps.
   *
   * @throws Error for a step that cannot be posed. The steps before it remain. A step that does not converge is no
   * error: see `certificate.converged` and `unsolved`.
   */
  step(count?: number): this;

  /**
   * Goes back by one step, exactly.
   *
   * @throws Error at the start, and if the earlier states are no longer kept
   */
  back(): this;

  /** Releases the memory. The simulation cannot be used afterwards. Garbage collection does the same. */
  free(): void;

  /** Name of the scene. */
  readonly name: string;
  /** Notes on probable mistakes in the scene. */
  readonly notes: string[];
  /** Names of the bodies. */
  readonly bodies: string[];
  /** Names of the fixed pieces, then of terrains. */
  readonly fixed: string[];
  /** Time step (s). */
  readonly timeStep: number;

  /** Index of the present step. */
  readonly index: number;
  /** Time (s). */
  readonly time: number;
  /** Kinetic and potential energy of all bodies (J), as in `steps.csv` from the first step on. */
  readonly energy: number;
  /** Counts of unsolved steps since the start. */
  readonly unsolved: Unsolved;

  /**
   * 13 numbers a body: position (m), attitude w, x, y, z, velocity (m/s), angular velocity in the body frame (rad/s).
   * These are the columns of `states.csv`. The array does not change with later steps.
   */
  readonly states: Float64Array;

  /** Present state of a body, by its name or index. */
  state(body: string | number): State;

  /** Contacts of the last step that have a force; empty if there is no last step. */
  readonly contacts: Contact[];

  /** Certificate of the last step; null at the start, and after some steps back. */
  readonly certificate: Certificate | null;

  /** Shapes for drawing. */
  readonly drawing: Drawing;
}
