// Lines, arrows and dots with a width in pixels. They are instances of a flat shape that the vertex
// shader places in the picture.

const PLACING = `
  uniform vec2 halfSize;
  uniform float nearest;
  // A place of the picture, in pixels from its middle.
  vec2 pixels(vec4 clip) { return clip.xy / clip.w * halfSize; }
`;
const FILLING = "uniform vec3 colour; uniform float alpha;";
const COLOUR_OUT = "gl_FragColor = vec4(colour, alpha); \n#include <colorspace_fragment>\n";

class Overlay extends THREE.Mesh {
  // `names` are the instance attributes, each with three numbers.
  constructor(shape, index, names, uniforms, vertexShader, fragmentShader) {
    const geometry = new THREE.InstancedBufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(shape, 3));
    geometry.setIndex(index);
    const values = {
      colour: { value: new THREE.Color() },
      alpha: { value: 1 },
      halfSize: { value: [1, 1] },
      nearest: { value: 1 },
      width: { value: 1 },
    };
    for (const [name, value] of Object.entries(uniforms)) values[name] = { value };
    const material = new THREE.ShaderMaterial({
      uniforms: values,
      vertexShader: `${PLACING}${names.map((name) => `attribute vec3 ${name};`).join("")}${vertexShader}`,
      fragmentShader: `${FILLING}${fragmentShader}`,
      transparent: true,
      depthWrite: false,
      side: THREE.DoubleSide,
    });
    super(geometry, material);
    this.frustumCulled = false;
    this.names = names;
    this.room = 0;
    this.set([]);
  }

  // Sets the attributes of all instances, given one instance after the other.
  set(numbers) {
    const each = 3 * this.names.length;
    const count = numbers.length / each;
    if (count > this.room) {
      this.room = 2 * count;
      this.geometry.dispose();
      for (const name of this.names) {
        const values = new Float32Array(3 * this.room);
        this.geometry.setAttribute(name, new THREE.InstancedBufferAttribute(values, 3));
      }
    }
    this.names.forEach((name, k) => {
      const attribute = this.geometry.getAttribute(name);
      if (!attribute) return;
      for (let i = 0; i < count; i += 1) {
        for (let axis = 0; axis < 3; axis += 1) {
          attribute.array[3 * i + axis] = numbers[each * i + 3 * k + axis];
        }
      }
      attribute.needsUpdate = true;
    });
    this.geometry.instanceCount = count;
    this.visible = count > 0;
  }

  // Sets uniforms: colour, alpha, width and others.
  look(values) {
    for (const [name, value] of Object.entries(values)) {
      const uniform = this.material.uniforms[name];
      if (uniform.value instanceof THREE.Color) uniform.value.set(value);
      else uniform.value = value;
    }
    return this;
  }

  // Disables the depth test, so that hidden parts are drawn too.
  through() {
    this.material.depthTest = false;
    return this;
  }
}

// Segments from `a` to `b`.
class Lines extends Overlay {
  constructor() {
    super(
      [0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0],
      [0, 1, 2, 0, 2, 3],
      ["a", "b"],
      {},
      `uniform float width;
      void main() {
        vec4 p = viewMatrix * vec4(a, 1.0);
        vec4 q = viewMatrix * vec4(b, 1.0);
        // The part before the camera.
        vec4 start = p.z > -nearest ? mix(p, q, (p.z + nearest) / (p.z - q.z)) : p;
        vec4 end = q.z > -nearest ? mix(q, p, (q.z + nearest) / (q.z - p.z)) : q;
        if (p.z > -nearest && q.z > -nearest) { gl_Position = vec4(0.0, 0.0, 2.0, 1.0); return; }
        vec4 from = projectionMatrix * start;
        vec4 to = projectionMatrix * end;
        vec2 way = pixels(to) - pixels(from);
        float size = length(way);
        vec2 along = size > 0.0 ? way / size : vec2(1.0, 0.0);
        gl_Position = position.x < 0.5 ? from : to;
        vec2 off = position.y * vec2(-along.y, along.x) + (2.0 * position.x - 1.0) * along * 0.5;
        gl_Position.xy += 0.5 * width * off / halfSize * gl_Position.w;
      }`,
      `void main() { ${COLOUR_OUT} }`,
    );
  }
}

// Arrows along `way`, with opacity `look.x`. They fade towards their start. `seam` is the width of
// the outline on each side.
class Arrows extends Overlay {
  constructor() {
    // Vertices: position along the arrow (0 start, 1 neck, 2 tip), position across, 1 for the head.
    super(
      [0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0, 1, -1, 1, 2, 0, 1, 1, 1, 1],
      [0, 1, 2, 0, 2, 3, 4, 5, 6],
      ["from", "way", "look"],
      { seam: 0 },
      `uniform float width; uniform float seam; varying float strength;
      void main() {
        vec4 here = viewMatrix * vec4(from, 1.0);
        vec4 there = viewMatrix * vec4(from + way, 1.0);
        gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
        if (here.z > -nearest || there.z > -nearest) return;
        vec2 start = pixels(projectionMatrix * here);
        vec2 span = pixels(projectionMatrix * there) - start;
        float size = length(span);
        if (size < 2.0) return;
        vec2 along = span / size;
        float head = min(4.6 * width, 0.6 * size);
        bool isHead = position.z > 0.5;
        float wide = isHead ? 0.42 * head + 1.6 * seam : 0.5 * width + seam;
        float neck = size - head - (isHead ? seam : 0.0);
        float at = position.x < 0.5 ? -seam : position.x < 1.5 ? neck : size + 2.2 * seam;
        vec2 spot = start + at * along + wide * position.y * vec2(-along.y, along.x);
        strength = look.x * (position.x < 0.5 ? 0.25 : 1.0);
        gl_Position = vec4(spot / halfSize, 0.0, 1.0);
      }`,
      `varying float strength;
      void main() { gl_FragColor = vec4(colour, alpha * strength); \n#include <colorspace_fragment>\n }`,
    );
    this.through();
  }
}

// Discs of `width` pixels at points. The depth offset `lift` keeps surfaces from hiding half of
// them.
class Dots extends Overlay {
  constructor() {
    super(
      [-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0],
      [0, 1, 2, 0, 2, 3],
      ["at"],
      { lift: 0, rim: new THREE.Color() },
      `uniform float width; uniform float lift; varying vec2 place;
      void main() {
        place = position.xy;
        vec4 here = viewMatrix * vec4(at, 1.0);
        gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
        if (here.z > -nearest) return;
        vec2 spot = pixels(projectionMatrix * here) + 0.5 * width * position.xy;
        here.z = min(here.z + lift, -nearest);
        vec4 deep = projectionMatrix * here;
        gl_Position = vec4(spot / halfSize, deep.z / deep.w, 1.0);
      }`,
      `uniform vec3 rim; varying vec2 place;
      void main() {
        float off = length(place);
        if (off > 1.0) discard;
        gl_FragColor = vec4(off > 0.68 ? rim : colour, alpha);
        #include <colorspace_fragment>
      }`,
    );
  }
}
