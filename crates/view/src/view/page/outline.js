// Outline of the chosen bodies: the rim of their silhouette, on top of the picture.

// Width in pixels.
const OUTLINE = 2.2;
const OUTLINE_TAPS = 10;

const CHOSEN_VERTEX = `
  attribute float chosen;
  void main() {
    gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
    if (chosen > 0.5) gl_Position = projectionMatrix * modelViewMatrix * instanceMatrix * vec4(position, 1.0);
  }
`;
const RIM_FRAGMENT = `
  uniform sampler2D mask; uniform vec2 pixels; uniform float wide; uniform vec3 colour;
  varying vec2 place;
  void main() {
    float most = 0.0;
    for (int i = 0; i < ${OUTLINE_TAPS}; i += 1) {
      float angle = 6.2831853 * float(i) / ${OUTLINE_TAPS}.0;
      vec2 off = wide * vec2(cos(angle), sin(angle)) / pixels;
      most = max(most, texture2D(mask, place + off).r);
    }
    gl_FragColor = vec4(colour, most * (1.0 - texture2D(mask, place).r));
    #include <colorspace_fragment>
  }
`;

class Outline {
  constructor() {
    this.scene = new THREE.Scene();
    this.material = new THREE.ShaderMaterial({
      vertexShader: CHOSEN_VERTEX,
      fragmentShader: "void main() { gl_FragColor = vec4(1.0); }",
      side: THREE.DoubleSide,
    });
    this.mask = new THREE.WebGLRenderTarget(1, 1, { depthBuffer: false });
    this.rim = new ScreenPass(["mask", "pixels", "wide", "colour"], RIM_FRAGMENT, { transparent: true });
    this.rim.set({ colour: new THREE.Color() });
  }

  // Adds instanced meshes with the attribute `chosen`.
  add(mesh) {
    const twin = new THREE.InstancedMesh(mesh.geometry, this.material, mesh.count);
    twin.instanceMatrix = mesh.instanceMatrix;
    twin.frustumCulled = false;
    this.scene.add(twin);
  }

  recolour() {
    this.rim.uniforms.colour.value.set(colours.chosen);
  }

  // Draws the outline over the picture.
  render(renderer, eye, width, height, ratio) {
    if (this.mask.width !== width || this.mask.height !== height) this.mask.setSize(width, height);
    renderer.setRenderTarget(this.mask);
    renderer.setClearColor("#000000", 0);
    renderer.render(this.scene, eye);
    renderer.autoClear = false;
    this.rim.set({ mask: this.mask.texture, pixels: [width, height], wide: OUTLINE * ratio });
    this.rim.render(renderer, null);
    renderer.autoClear = true;
  }
}
