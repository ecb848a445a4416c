// Ground: a plane with a grid and shadows that fades into the background.

// Share of the radius from which the ground fades.
const FADE_START = 0.35;

class Floor {
  constructor(ground, ambience) {
    this.ground = ground;
    const { axes, middle, radius, spacing, normal } = ground;
    const corner = ([x, y]) => add(local(middle), add(times(axes[0], x * radius), times(axes[1], y * radius)));
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
    const geometry = new THREE.BufferGeometry();
    const attribute = (values, items) => new THREE.Float32BufferAttribute(values.flat(), items);
    geometry.setAttribute("position", attribute(corners.map(corner), 3));
    geometry.setAttribute("normal", attribute(corners.map(() => normal), 3));
    geometry.setAttribute("uv", attribute(corners, 2));
    // The axes of the ground may be left-handed.
    const isTurned = dot(cross(...axes), normal) < 0;
    geometry.setIndex(isTurned ? [0, 2, 1, 0, 3, 2] : [0, 1, 2, 0, 2, 3]);
    const start = axes.map((axis) => dot(axis, middle) / spacing);
    this.uniforms = {
      ground: { value: new THREE.Color() },
      line: { value: new THREE.Color() },
      depth: { value: 0 },
      alpha: { value: 1 },
      cells: { value: radius / spacing },
      // Whole cells are omitted, since the graphics card has single precision.
      start: { value: start.map((x) => x - Math.floor(x)) },
      ...ambience.uniforms,
    };
    this.material = new THREE.ShadowMaterial({ side: THREE.DoubleSide });
    this.material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.uniforms);
      shader.vertexShader = `varying vec2 at;\n${shader.vertexShader}`.replace(
        "#include <begin_vertex>",
        "#include <begin_vertex>\n at = uv;",
      );
      shader.fragmentShader = `
        varying vec2 at; uniform vec3 ground; uniform vec3 line; uniform vec2 start;
        uniform float depth; uniform float alpha; uniform float cells;
        ${AMBIENCE}
        ${shader.fragmentShader}`.replace(
        /gl_FragColor = [^;]*;/,
        `
        vec2 cell = cells * at + start;
        vec2 pixel = fwidth(cell);
        vec2 off = abs(fract(cell - 0.5) - 0.5) / max(pixel, vec2(1e-6));
        // Lines closer than a few pixels merge into the ground.
        vec2 lined = clamp(1.1 - off, 0.0, 1.0) * clamp(1.4 - 6.0 * pixel, 0.0, 1.0);
        vec3 paint = mix(ground, line, max(lined.x, lined.y));
        float shade = 1.0 - (1.0 - depth * (1.0 - getShadowMask())) * mix(1.0, ambientShare(), 0.8);
        float fade = 1.0 - smoothstep(${FADE_START}, 1.0, length(at));
        gl_FragColor = vec4(mix(paint, color, shade), alpha * fade);`,
      );
    };
    this.plane = new THREE.Mesh(geometry, this.material);
    this.plane.receiveShadow = true;
    this.plane.renderOrder = -10;
    this.plane.frustumCulled = false;
  }

  recolour() {
    this.uniforms.ground.value.set(colours.ground);
    this.uniforms.line.value.set(colours.grid);
    this.uniforms.depth.value = Number(colours["shadow-depth"]);
    this.material.color.set(colours.shadow);
  }

  // Makes the ground transparent from below. Returns true if the eye is above it.
  look(eye) {
    const isAbove = this.ground.height(add(eye, BASE)) > 0;
    this.uniforms.alpha.value = isAbove ? 1 : 0.6;
    this.material.depthWrite = isAbove;
    // Seen from below, the scene is drawn before the ground.
    this.plane.renderOrder = isAbove ? -10 : 5;
    return isAbove;
  }
}
