// Ambient occlusion: how much of the sky each visible point sees, estimated from the depths around
// it. It is computed at half the resolution and read by the materials of bodies and ground.

// Occlusion radius over the size of a typical body, and strength.
const OCCLUSION_REACH = 0.8;
const OCCLUSION_STRENGTH = 1.15;
// Smallest share of the ambient light.
const DARKEST = 0.35;
// Number of samples of a pixel, and turns of their spiral.
const OCCLUSION_SAMPLES = 11;

const SCREEN_VERTEX = "varying vec2 place; void main() { place = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }";
const DEPTHS = `
  uniform sampler2D depths; uniform vec2 ends; varying vec2 place;
  // Coordinate along the view, negative before the camera.
  float behind(vec2 at) {
    float depth = texture2D(depths, at).r;
    return ends.x * ends.y / ((ends.y - ends.x) * depth - ends.y);
  }
`;
// Scalable ambient obscurance of McGuire, Mara and Luebke (2012), with lengths over the radius.
const OCCLUSION_FRAGMENT = `
  uniform sampler2D normals; uniform vec2 slopes; uniform vec2 pixels; uniform float reach;
  ${DEPTHS}
  vec3 spot(vec2 at) {
    float z = behind(at);
    return vec3((1.0 - 2.0 * at) * slopes * z, z);
  }
  void main() {
    vec4 coded = texture2D(normals, place);
    if (coded.a < 0.5) { gl_FragColor = vec4(1.0); return; }
    vec3 normal = normalize(2.0 * coded.rgb - 1.0);
    vec3 here = spot(place);
    float wide = clamp(0.5 * reach / (slopes.y * -here.z), 2.0 / pixels.y, 0.2);
    // A pattern of 4 by 4 pixels, which the blur removes.
    vec2 cell = mod(floor(gl_FragCoord.xy), 4.0);
    float turn = 6.2831853 * fract((4.0 * cell.x + cell.y) * 0.6180340 + cell.x * 0.37);
    float sum = 0.0;
    for (int i = 0; i < ${OCCLUSION_SAMPLES}; i += 1) {
      float share = (float(i) + 0.5) / ${OCCLUSION_SAMPLES}.0;
      float angle = turn + float(i) * 2.3999632;
      vec2 off = share * wide * vec2(cos(angle) * pixels.y / pixels.x, sin(angle));
      vec3 way = (spot(place + off) - here) / reach;
      float square = dot(way, way);
      float height = dot(way, normal) + 0.02 * here.z / reach * slopes.y;
      sum += pow(max(1.0 - square, 0.0), 3.0) * max(height, 0.0) / (square + 0.01);
    }
    gl_FragColor = vec4(max(${DARKEST}, 1.0 - ${OCCLUSION_STRENGTH} * 5.0 * sum / ${OCCLUSION_SAMPLES}.0));
  }
`;
// Mean over the pattern, of points at similar depths.
const BLUR_FRAGMENT = `
  uniform sampler2D occlusion; uniform vec2 pixels; uniform float reach;
  ${DEPTHS}
  void main() {
    float here = behind(place);
    vec2 sum = vec2(1e-4);
    for (int x = -2; x < 2; x += 1) {
      for (int y = -2; y < 2; y += 1) {
        vec2 at = place + (vec2(x, y) + 0.5) / pixels;
        float weight = max(0.0, 1.0 - abs(behind(at) - here) / (0.35 * reach));
        sum += weight * vec2(texture2D(occlusion, at).r, 1.0);
      }
    }
    gl_FragColor = vec4(sum.x / sum.y);
  }
`;

// A shader that fills the picture.
class ScreenPass {
  constructor(uniforms, fragmentShader, options = {}) {
    this.uniforms = {};
    for (const name of uniforms) this.uniforms[name] = { value: null };
    const material = new THREE.ShaderMaterial({
      uniforms: this.uniforms,
      vertexShader: SCREEN_VERTEX,
      fragmentShader,
      depthTest: false,
      depthWrite: false,
      ...options,
    });
    this.scene = new THREE.Scene();
    const corner = (values, items) => new THREE.Float32BufferAttribute(values, items);
    // One triangle that covers the picture.
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", corner([-1, -1, 0, 3, -1, 0, -1, 3, 0], 3));
    geometry.setAttribute("uv", corner([0, 0, 2, 0, 0, 2], 2));
    const mesh = new THREE.Mesh(geometry, material);
    mesh.frustumCulled = false;
    this.scene.add(mesh);
    this.camera = new THREE.Camera();
  }

  set(values) {
    for (const [name, value] of Object.entries(values)) this.uniforms[name].value = value;
  }

  render(renderer, target) {
    renderer.setRenderTarget(target);
    renderer.render(this.scene, this.camera);
  }
}

class Ambience {
  // `reach` is the size of a typical body.
  constructor(reach) {
    this.reach = OCCLUSION_REACH * reach;
    // The shapes that occlude.
    this.scene = new THREE.Scene();
    const depthTexture = new THREE.DepthTexture(1, 1);
    this.shapes = new THREE.WebGLRenderTarget(1, 1, { depthTexture });
    this.raw = new THREE.WebGLRenderTarget(1, 1, { depthBuffer: false });
    this.smooth = new THREE.WebGLRenderTarget(1, 1, { depthBuffer: false });
    this.normals = new THREE.MeshNormalMaterial({ side: THREE.DoubleSide });
    const shared = ["depths", "ends", "pixels", "reach"];
    this.find = new ScreenPass([...shared, "normals", "slopes"], OCCLUSION_FRAGMENT);
    this.blur = new ScreenPass([...shared, "occlusion"], BLUR_FRAGMENT);
    const white = new Uint8Array([255, 255, 255, 255]);
    this.none = new THREE.DataTexture(white, 1, 1);
    this.none.needsUpdate = true;
    // Uniforms of the materials that read it.
    this.uniforms = { ambience: { value: this.none }, screen: { value: [1, 1] } };
  }

  // Adds the shapes of instanced meshes, or of one mesh.
  add(mesh) {
    const twin = mesh.isInstancedMesh
      ? new THREE.InstancedMesh(mesh.geometry, this.normals, mesh.count)
      : new THREE.Mesh(mesh.geometry, this.normals);
    if (mesh.isInstancedMesh) twin.instanceMatrix = mesh.instanceMatrix;
    twin.frustumCulled = false;
    this.scene.add(twin);
  }

  // Computes the occlusion in a picture of `width` by `height` pixels.
  render(renderer, eye, width, height) {
    const [w, h] = [Math.max(1, Math.ceil(width / 2)), Math.max(1, Math.ceil(height / 2))];
    for (const target of [this.shapes, this.raw, this.smooth]) {
      if (target.width !== w || target.height !== h) target.setSize(w, h);
    }
    renderer.setRenderTarget(this.shapes);
    renderer.setClearColor("#000000", 0);
    renderer.render(this.scene, eye);
    const slope = Math.tan((eye.fov * Math.PI) / 360);
    const shared = {
      depths: this.shapes.depthTexture,
      ends: [eye.near, eye.far],
      pixels: [w, h],
      reach: this.reach,
    };
    this.find.set({ ...shared, normals: this.shapes.texture, slopes: [slope * eye.aspect, slope] });
    this.find.render(renderer, this.raw);
    this.blur.set({ ...shared, occlusion: this.raw.texture });
    this.blur.render(renderer, this.smooth);
    renderer.setRenderTarget(null);
    Object.assign(this.uniforms.ambience, { value: this.smooth.texture });
    this.uniforms.screen.value = [width, height];
  }

  // Disables the occlusion.
  skip() {
    this.uniforms.ambience.value = this.none;
  }
}

// Share of the ambient light, for fragment shaders with the uniforms of an `Ambience`.
const AMBIENCE = `
  uniform sampler2D ambience; uniform vec2 screen;
  float ambientShare() { return texture2D(ambience, gl_FragCoord.xy / screen).r; }
`;
