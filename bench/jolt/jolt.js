// Scenes of the contact benchmark by Jolt Physics in WebAssembly: `node jolt.js` for python/tumble/bench/engines/jolt.py.
//
// The first line of standard input is a scene. It has the wrenches of all steps, or else every further line those of a step.
// Every line of standard output has the states after a step, and the last one the processor time of the steps in seconds.

import { createInterface } from 'node:readline';
import init from 'jolt-physics/wasm-compat';

const Jolt = await init();
const vec = ([x, y, z]) => new Jolt.Vec3(x, y, z);
const place = ([x, y, z]) => new Jolt.RVec3(x, y, z);
const quat = ([w, x, y, z]) => new Jolt.Quat(x, y, z, w);

function shapeOf(body) {
  if (body.kind === 'box') return new Jolt.BoxShape(vec(body.size), 0.0);
  if (body.kind === 'sphere') return new Jolt.SphereShape(body.size[0]);
  if (body.kind === 'capsule') {
    // Jolt's capsules are along y.
    const upright = new Jolt.CapsuleShapeSettings(body.size[1], body.size[0]);
    const turn = quat([Math.SQRT1_2, Math.SQRT1_2, 0, 0]);
    return new Jolt.RotatedTranslatedShapeSettings(vec([0, 0, 0]), turn, upright).Create().Get();
  }
  const hull = new Jolt.ConvexHullShapeSettings();
  hull.mMaxConvexRadius = 0.0;
  for (const point of body.points) hull.mPoints.push_back(vec(point));
  const made = hull.Create();
  if (made.HasError()) throw new Error(made.GetError().c_str());
  return made.Get();
}

function begin(scene) {
  const settings = new Jolt.JoltSettings();
  const pairs = new Jolt.ObjectLayerPairFilterTable(2);
  pairs.EnableCollision(0, 1);
  pairs.EnableCollision(1, 1);
  const phases = new Jolt.BroadPhaseLayerInterfaceTable(2, 2);
  phases.MapObjectToBroadPhaseLayer(0, new Jolt.BroadPhaseLayer(0));
  phases.MapObjectToBroadPhaseLayer(1, new Jolt.BroadPhaseLayer(1));
  settings.mObjectLayerPairFilter = pairs;
  settings.mBroadPhaseLayerInterface = phases;
  settings.mObjectVsBroadPhaseLayerFilter = new Jolt.ObjectVsBroadPhaseLayerFilterTable(phases, 2, pairs, 2);
  const jolt = new Jolt.JoltInterface(settings);
  const system = jolt.GetPhysicsSystem();
  system.SetGravity(vec(scene.gravity));
  const physics = system.GetPhysicsSettings();
  physics.mMinVelocityForRestitution = scene.bounce_from;
  for (const [name, value] of Object.entries(scene.settings)) {
    if (!(name in physics)) throw new Error(`Jolt has no setting ${name}`);
    physics[name] = value;
  }
  system.SetPhysicsSettings(physics);

  const bodies = [];
  const add = (body, moving) => {
    const kind = moving ? Jolt.EMotionType_Dynamic : Jolt.EMotionType_Static;
    const made = new Jolt.BodyCreationSettings(shapeOf(body), place(body.position), quat(body.attitude), kind, moving ? 1 : 0);
    Object.assign(made, { mFriction: scene.friction, mRestitution: scene.restitution, mLinearDamping: 0, mAngularDamping: 0 });
    Object.assign(made, { mAllowSleeping: false, mApplyGyroscopicForce: true, mMaxLinearVelocity: 1e4, mMaxAngularVelocity: 1e4 });
    if (moving) {
      made.mOverrideMassProperties = Jolt.EOverrideMassProperties_MassAndInertiaProvided;
      made.mMassPropertiesOverride.mMass = body.mass;
      made.mMassPropertiesOverride.mInertia = Jolt.Mat44.prototype.sScaleVec3(vec(body.inertia));
      made.mLinearVelocity = vec(body.velocity);
      made.mAngularVelocity = vec(body.world_spin);
    }
    const found = system.GetBodyInterface().CreateBody(made);
    system.GetBodyInterface().AddBody(found.GetID(), Jolt.EActivation_Activate);
    if (moving) bodies.push(found);
  };
  if (scene.ground) {
    // The surface of a large box is flat and has no end that a case reaches.
    add({ kind: 'box', size: [100, 100, 10], position: [0, 0, -10], attitude: [1, 0, 0, 0] }, false);
  }
  for (const body of scene.bodies) add(body, !body.fixed);
  return { jolt, bodies };
}

function states(bodies) {
  return bodies.map((body) => {
    const [p, q, v, w] = [body.GetCenterOfMassPosition(), body.GetRotation(), body.GetLinearVelocity(), body.GetAngularVelocity()];
    const numbers = [p, v, w].map((part) => [part.GetX(), part.GetY(), part.GetZ()]);
    return [...numbers[0], q.GetW(), q.GetX(), q.GetY(), q.GetZ(), ...numbers[1], ...numbers[2]];
  });
}

let world = null;
let scene = null;
let seconds = 0;

function step(wrenches) {
  wrenches.forEach((wrench, at) => {
    world.bodies[at].AddForce(vec(wrench.slice(0, 3)));
    world.bodies[at].AddTorque(vec(wrench.slice(3)));
  });
  const start = process.cpuUsage();
  world.jolt.Step(scene.time_step, 1);
  const taken = process.cpuUsage(start);
  seconds += 1e-6 * (taken.user + taken.system);
  process.stdout.write(JSON.stringify(states(world.bodies)) + '\n');
}

for await (const line of createInterface({ input: process.stdin })) {
  if (world !== null) {
    step(JSON.parse(line));
    continue;
  }
  scene = JSON.parse(line);
  world = begin(scene);
  scene.wrenches.forEach(step);
}
process.stdout.write(seconds + '\n');
