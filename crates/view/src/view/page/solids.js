// Bodies and fixed objects in three.js. Each distinct shape is one instanced mesh. All boxes share
// one shape, and all balls another.

// Line width on surfaces (pixels), and brightness of lines over that of the surface.
const LINE_WIDTH = 1.1;
const LINE_SHADE = 0.62;
const ROUGHNESS = 0.58;

// Brightness of contour lines over that of the surface; every fifth is darker.
const CONTOUR_SHADES = [0.86, 0.7];

// Physically based material with lines, and with contour lines in steps of `contour` (m).
function surfaceMaterial(alpha, ambience, contour = 0) {
  const material = new THREE.MeshStandardMaterial({
    transparent: alpha < 1,
    opacity: alpha,
    roughness: ROUGHNESS,
    metalness: 0,
    // Visual meshes may be open.
    side: THREE.DoubleSide,
    shadowSide: THREE.DoubleSide,
  });
  material.userData = { ratio: { value: 1 }, ...ambience.uniforms };
  // Programs of equal functions are shared unless they have names.
  material.customProgramCacheKey = () => `surface ${contour}`;
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, material.userData);
    shader.vertexShader = `
      attribute vec2 line;
      attribute float strength;
      varying float height;
      varying vec2 vLine;
      varying float vStrength;
      ${shader.vertexShader}`.replace(
      "#include <begin_vertex>",
      "#include <begin_vertex>\n vLine = line; vStrength = strength; height = position.z;",
    );
    shader.fragmentShader = `
      uniform float ratio;
      varying float height;
      varying vec2 vLine;
      varying float vStrength;
      ${AMBIENCE}
      ${shader.fragmentShader}`
      .replace(
        "#include <aomap_fragment>",
        `float share = ambientShare();
        reflectedLight.indirectDiffuse *= share;
        reflectedLight.directDiffuse *= mix(1.0, share, 0.4);`,
      )
      .replace(
        "#include <opaque_fragment>",
        `#include <opaque_fragment>
        vec2 pixel = max(fwidth(vLine), vec2(1e-9));
        // Lines do not cover small bodies.
        vec2 wide = min(vec2(ratio * ${LINE_WIDTH}), 0.06 / pixel);
        vec2 lined = clamp(0.5 - vLine / pixel + wide, 0.0, 1.0) * min(vec2(1.0), wide);
        gl_FragColor.rgb *= mix(1.0, ${LINE_SHADE * LINE_SHADE}, vStrength * max(lined.x, lined.y));
        ${contour > 0 ? contourLines(contour) : ""}`,
      );
  };
  return material;
}

// Fragment code of contour lines. Lines closer than a few pixels fade, and level parts have none.
const contourLines = (step) => `
  float level = height / float(${step});
  float levelPixel = max(fwidth(level), 1e-9);
  float fromLine = abs(fract(level - 0.5) - 0.5) / levelPixel;
  float isFifth = step(abs(fract(0.2 * level + 0.5) - 0.5), 0.1);
  float isClear = clamp(1.5 - 4.0 * levelPixel, 0.0, 1.0) * step(1e-4, levelPixel);
  float contour = clamp(0.5 + ratio * 0.6 - fromLine, 0.0, 1.0) * isClear;
  gl_FragColor.rgb *= mix(1.0, mix(${CONTOUR_SHADES}, isFifth), contour);`;

// Pieces of many `things`. Meshes have contour lines in steps of `contour` (m), if it is not 0.
class Solids {
  constructor(things, alpha, ambience, contour = 0) {
    this.material = surfaceMaterial(alpha, ambience);
    const terrain = contour > 0 ? surfaceMaterial(alpha, ambience, contour) : this.material;
    terrain.userData.ratio = this.material.userData.ratio;
    const shapes = new Map();
    things.forEach(({ pieces }, thing) => {
      for (const piece of pieces) {
        const { shape, middle, stretch } = stretched(piece);
        const name = JSON.stringify(shape.mesh ?? shape);
        if (!shapes.has(name)) shapes.set(name, { shape, owners: [], forms: [] });
        shapes.get(name).owners.push(thing);
        shapes.get(name).forms.push({ middle, stretch, colour: piece.colour });
      }
    });
    this.meshes = [...shapes.values()].map(({ shape, owners, forms }) => {
      const geometry = pieceGeometry(shape);
      const chosen = new THREE.InstancedBufferAttribute(new Float32Array(owners.length), 1);
      geometry.setAttribute("chosen", chosen);
      const mesh = new THREE.InstancedMesh(geometry, shape.mesh ? terrain : this.material, owners.length);
      Object.assign(mesh, { castShadow: true, receiveShadow: true, frustumCulled: false });
      mesh.userData = { owners, forms, chosen };
      return mesh;
    });
  }

  // Sets colours and the selection. Pieces may have colours of their own.
  paint(hue, isChosen) {
    const colour = new THREE.Color();
    for (const mesh of this.meshes) {
      const { owners, forms, chosen } = mesh.userData;
      owners.forEach((thing, i) => {
        mesh.setColorAt(i, colour.set(forms[i].colour ?? hue(thing)));
        chosen.setX(i, Number(isChosen(thing)));
      });
      mesh.instanceColor.needsUpdate = true;
      chosen.needsUpdate = true;
    }
  }

  // Sets the poses: place and attitude (q_w, q_x, q_y, q_z), or null for hidden things.
  place(poses) {
    for (const mesh of this.meshes) {
      const { array } = mesh.instanceMatrix;
      const { owners, forms } = mesh.userData;
      owners.forEach((thing, i) => matrixOf(poses[thing], forms[i], array, 16 * i));
      mesh.instanceMatrix.needsUpdate = true;
    }
  }

  // Nearest intersection of a ray: thing and distance; null if there is none.
  hit(ray) {
    let nearest = null;
    for (const mesh of this.meshes) {
      mesh.boundingSphere = null;
      for (const { distance, instanceId } of ray.intersectObject(mesh)) {
        if (nearest === null || distance < nearest.distance) {
          nearest = { distance, thing: mesh.userData.owners[instanceId] };
        }
      }
    }
    return nearest;
  }
}

// Writes the column-major matrix of a pose after scaling and shift. A null pose yields zeros, which
// draw nothing.
function matrixOf(pose, { middle, stretch }, into, at) {
  if (pose === null) {
    into.fill(0, at, at + 16);
    return;
  }
  const [w, x, y, z] = pose.attitude;
  into[at] = 1 - 2 * (y * y + z * z);
  into[at + 1] = 2 * (x * y + w * z);
  into[at + 2] = 2 * (x * z - w * y);
  into[at + 4] = 2 * (x * y - w * z);
  into[at + 5] = 1 - 2 * (x * x + z * z);
  into[at + 6] = 2 * (y * z + w * x);
  into[at + 8] = 2 * (x * z + w * y);
  into[at + 9] = 2 * (y * z - w * x);
  into[at + 10] = 1 - 2 * (x * x + y * y);
  for (let row = 0; row < 3; row += 1) {
    const turned = [0, 4, 8].map((column) => into[at + column + row]);
    into[at + 12 + row] = pose.place[row] + dot(turned, middle);
    [0, 4, 8].forEach((column, axis) => {
      into[at + column + row] *= stretch[axis];
    });
  }
  into[at + 15] = 1;
}
