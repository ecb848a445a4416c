// Overlays that only the playground has: the spring of a pull, and slip.

// Length of a slip arrow over that of the largest force arrow, at the speed of a fall by it.
const SLIP_LENGTH = 0.8;

class LiveOverlays {
  constructor(stage, run) {
    this.run = run;
    this.stage = stage;
    this.spring = new Lines().through();
    this.ends = new Dots().through();
    this.slip = new Arrows();
    [this.slip, this.spring, this.ends].forEach((part, i) => {
      part.renderOrder = 40 + i;
      stage.scene.add(part);
    });
    const { longest } = run.data.arrows;
    this.slipSpeed = Math.sqrt(2 * 9.81 * longest);
  }

  recolour() {
    this.spring.look({ colour: colours.accent, width: 2 });
    this.ends.look({ colour: colours.accent, rim: colours.card, width: 9 });
    this.slip.look({ colour: colours.failed, width: 2.2 });
  }

  // Shows the spring of a pull from `place` to `target`, and the slip of contacts.
  set(head, showsSlip) {
    const isPulled = head !== null && head.grabbed >= 0;
    const ends = isPulled ? [head.place, head.target].map(local) : [];
    this.spring.set(ends.flat());
    this.ends.set(ends.flat());
    const arrows = [];
    for (const { point, slip } of showsSlip ? this.run.forces() : []) {
      const speed = length(slip);
      if (!(speed > 1e-6 * this.slipSpeed)) continue;
      const share = speed / (speed + this.slipSpeed);
      const size = SLIP_LENGTH * this.run.data.arrows.longest * share;
      arrows.push(...local(point), ...times(slip, size / speed), 1, 0, 0);
    }
    this.slip.set(arrows);
  }
}

// Frees the memory of a stage on the graphics card, except for its canvas.
function freeStage(stage) {
  const targets = [stage.ambience, stage.outline].flatMap((part) => Object.values(part));
  for (const part of targets) if (part instanceof THREE.WebGLRenderTarget) part.dispose();
  stage.light.sun.shadow.map?.dispose();
  for (const scene of [stage.scene, stage.ambience.scene, stage.outline.scene]) {
    scene.traverse((part) => {
      part.geometry?.dispose();
      part.material?.dispose();
      if (part.isInstancedMesh) part.dispose();
    });
  }
}
