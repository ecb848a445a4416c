// Bodies and fixed objects in three.js. Each distinct shape is one instanced mesh. All boxes share
// one shape, and all balls another.

// Line width on surfaces (pixels), for normal and for chosen bodies.
const LINE_WIDTHS = [1.1, 2.4];

// Material of lit surfaces with lines.
function surfaceMaterial(alpha) {
  const material = new THREE.MeshLambertMaterial({ transparent: alpha < 1, opacity: alpha });
  material.userData = {
    edge: { value: new THREE.Color() },
    chosenEdge: { value: new THREE.Color() },
    ratio: { value: 1 },
  };
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, material.userData);
    shader.vertexShader = `
      attribute vec2 line;
      attribute float chosen;
      varying vec2 vLine;
      varying float vChosen;
      ${shader.vertexShader}`.replace(
      "#include <begin_vertex>",
      "#include <begin_vertex>\n vLine = line; vChosen = chosen;",
    );
    shader.fragmentShader = `
      uniform vec3 edge;
      uniform vec3 chosenEdge;
      uniform float ratio;
      varying vec2 vLine;
      varying float vChosen;
      ${shader.fragmentShader}`.replace(
      "#include <opaque_fragment>",
      `#include <opaque_fragment>
      vec2 pixel = max(fwidth(vLine), vec2(1e-9));
      // Of what is a few pixels large, lines would leave nothing.
      vec2 most = mix(0.06, 0.15, vChosen) / pixel;
      vec2 wide = min(vec2(ratio * mix(${LINE_WIDTHS[0]}, ${LINE_WIDTHS[1]}, vChosen)), most);
      vec2 off = vLine / pixel - wide;
      vec2 share = clamp(0.5 - off, 0.0, 1.0) * min(vec2(1.0), wide);
      // Of a chosen body that is round the outline is a line too.
      float grazing = 1.0 - abs(dot(normal, normalize(vViewPosition)));
      float rim = vChosen * smoothstep(0.55, 0.8, grazing);
      float lined = max(rim, max(share.x, share.y));
      gl_FragColor.rgb = mix(gl_FragColor.rgb, mix(edge, chosenEdge, vChosen), lined);`,
    );
  };
  return material;
}

// Pieces of many `things`.
class Solids {
  constructor(things, alpha) {
    this.material = surfaceMaterial(alpha);
    const shapes = new Map();
    things.forEach(({ pieces }, thing) => {
      for (const piece of pieces) {
        const { shape, middle, stretch } = stretched(piece);
        const name = JSON.stringify(shape);
        if (!shapes.has(name)) shapes.set(name, { shape, owners: [], forms: [] });
        shapes.get(name).owners.push(thing);
        shapes.get(name).forms.push({ middle, stretch });
      }
    });
    this.meshes = [...shapes.values()].map(({ shape, owners, forms }) => {
      const geometry = pieceGeometry(shape);
      const chosen = new THREE.InstancedBufferAttribute(new Float32Array(owners.length), 1);
      geometry.setAttribute("chosen", chosen);
      const mesh = new THREE.InstancedMesh(geometry, this.material, owners.length);
      Object.assign(mesh, { castShadow: true, receiveShadow: true, frustumCulled: false });
      mesh.userData = { owners, forms, chosen };
      return mesh;
    });
  }

  // Sets colours and the selection.
  paint(hue, isChosen) {
    const colour = new THREE.Color();
    for (const mesh of this.meshes) {
      mesh.userData.owners.forEach((thing, i) => {
        mesh.setColorAt(i, colour.set(hue(thing)));
        mesh.userData.chosen.setX(i, Number(isChosen(thing)));
      });
      mesh.instanceColor.needsUpdate = true;
      mesh.userData.chosen.needsUpdate = true;
    }
    this.material.userData.edge.value.set(colours.edge);
    this.material.userData.chosenEdge.value.set(colours.chosen);
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
