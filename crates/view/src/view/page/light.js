// Light: a sun with soft shadows, and the sky.

const SHADOW_PIXELS = 1536;
// Width of the soft rim of shadows, in pixels of the shadow map.
const SOFTNESS = 2.6;
// Largest size of the lit scene with fixed objects over that of the bodies.
const MOST_WIDENED = 3;
const SUN = 2.15;
const SKY = 2.05;

class Light {
  constructor(scene) {
    this.sun = new THREE.DirectionalLight("#fffaf2", SUN);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(SHADOW_PIXELS, SHADOW_PIXELS);
    this.sun.shadow.radius = SOFTNESS;
    this.sky = new THREE.HemisphereLight("#ffffff", "#aab3c0", SKY);
    this.sky.position.set(...UP);
    scene.add(this.sun, this.sun.target, this.sky);
  }

  // Fits the shadow map to a ball around all bodies, and around the fixed objects that are not much
  // larger. Its position and size change in steps, which prevents flicker.
  castShadows(drawn, fixed, floor) {
    if (drawn.length === 0) return;
    const middle = times(drawn.map(({ place }) => place).reduce(add), 1 / drawn.length);
    const ends = (balls) => balls.map(({ place, reach }) => length(subtract(place, middle)) + reach);
    const own = largest(ends(drawn));
    const reach = largest([own, ...ends(fixed).filter((end) => end < MOST_WIDENED * own)]);
    const size = 1.2 ** Math.ceil(Math.log(Math.max(reach, 1e-9)) / Math.log(1.2));
    const texel = (2 * size) / SHADOW_PIXELS;
    const across = unit(cross(LIGHT, [0, 1, 0]));
    const axes = [across, cross(LIGHT, across), LIGHT];
    const snapped = axes.map((axis, k) =>
      times(axis, k < 2 ? Math.round(dot(axis, middle) / texel) * texel : dot(axis, middle)),
    );
    const target = snapped.reduce(add);
    const height = floor ? Math.abs(floor.ground.height(add(target, BASE))) : 0;
    this.sun.target.position.set(...target);
    this.sun.position.set(...add(target, times(LIGHT, 2 * size)));
    const { shadow } = this.sun;
    Object.assign(shadow.camera, { left: -size, right: size, bottom: -size, top: size });
    Object.assign(shadow.camera, { near: 0.5 * size, far: 4 * size + 3 * height });
    shadow.camera.updateProjectionMatrix();
    shadow.normalBias = (1 + SOFTNESS) * texel;
    shadow.bias = -(2 * texel) / shadow.camera.far;
  }
}
