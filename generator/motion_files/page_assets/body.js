// A body on the stage: the binary glTF of a motion, moved by its frames.
"use strict";
(() => {
  const { between } = mover;

  /** Nodes by the names in the file; the loader's own names have no special characters. */
  function nodesOf({ parser }) {
    const nodes = new Map();
    for (const [object, { nodes: index }] of parser.associations)
      if (index !== undefined) nodes.set(parser.json.nodes[index].name, object);
    return nodes;
  }

  async function animationChannels({ parser }) {
    const { channels, samplers } = parser.json.animations?.[0] ?? { channels: [], samplers: [] }; // a pose has none
    return Promise.all(
      channels.map(async ({ sampler, target }) => ({
        node: await parser.getDependency("node", target.node),
        path: target.path,
        values: (await parser.getDependency("accessor", samplers[sampler].output)).array,
      })),
    );
  }

  /** Corners in the world of the box of a mesh. */
  const cornersOf = ({ geometry: { boundingBox: { min, max } }, matrixWorld }) =>
    Array.from({ length: 8 }, (_, k) =>
      new THREE.Vector3((k & 1 ? min : max).x, (k & 2 ? min : max).y, (k & 4 ? min : max).z).applyMatrix4(matrixWorld));
  mover.cornersOf = cornersOf;

  const inflated = (bytes) =>
    new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();

  /** Read body and props of a deflated binary glTF: `{ body, props }`; `frames` is the number of its frames. */
  mover.readBody = async (bytes, frames) => {
    const gltf = await new THREE.GLTFLoader().parseAsync(await inflated(bytes), "");
    const props = gltf.scene.children.filter((object) => object.userData.prop);
    for (const prop of props) gltf.scene.remove(prop);
    return { body: makeBody(gltf.scene, await animationChannels(gltf), nodesOf(gltf), frames), props };
  };

  function makeBody(figure, channels, nodes, frames) {
    const meshes = [];
    const [from, to] = [new THREE.Quaternion(), new THREE.Quaternion()];
    figure.traverse((object) => {
      if (!object.isMesh) return;
      object.material = object.material.clone(); // to highlight one segment only
      object.userData.joint ??= object.parent.userData.joint; // a mesh stands within its bone
      object.userData.colour = object.material.color.clone();
      object.castShadow = object.receiveShadow = true;
      object.geometry.computeBoundingBox();
      meshes.push(object);
    });

    function move([low, next, part]) {
      for (const { node, path, values } of channels) {
        if (path === "rotation") {
          from.fromArray(values, 4 * low);
          to.fromArray(values, 4 * next);
          node.quaternion.slerpQuaternions(from, to, part);
        } else {
          const at = (k) => between(values, [3 * low + k, 3 * next + k, part]);
          node.position.set(at(0), at(1), at(2));
        }
      }
      figure.updateMatrixWorld();
    }

    const box = new THREE.Box3();
    const grow = (bounds) => {
      for (const mesh of meshes) bounds.union(box.copy(mesh.geometry.boundingBox).applyMatrix4(mesh.matrixWorld));
      return bounds;
    };
    const centre = () => grow(new THREE.Box3()).getCenter(new THREE.Vector3());

    // The body over the whole motion, from some of its frames: boxes, and the corners of the
    // segments' boxes, in the world and relative to the middle of the body.
    const [whole, first, places, corners] = [new THREE.Box3(), new THREE.Box3(), [], []];
    const count = Math.min(frames, 80);
    for (let k = count - 1; k >= 0; k--) {
      const frame = Math.round((k * (frames - 1)) / Math.max(count - 1, 1));
      move([frame, frame, 0]);
      grow(whole);
      const middle = centre();
      for (const corner of meshes.flatMap(cornersOf)) {
        places.push(corner);
        corners.push(corner.clone().sub(middle));
      }
      if (k === 0) grow(first);
    }

    /** Tint the meshes of a joint; null tints none. */
    function highlight(joint, tint) {
      for (const mesh of meshes) {
        mesh.material.color.copy(mesh.userData.colour);
        if (mesh.userData.joint === joint) mesh.material.color.lerp(new THREE.Color(tint), 0.75);
      }
    }

    const size = Math.max(first.getSize(new THREE.Vector3()).length(), 1e-3);
    const isFar = whole.getSize(new THREE.Vector3()).length() > 4 * size;
    const pose = (name) => (nodes.has(name) ? nodes.get(name).matrixWorld.toArray() : null);
    return { figure, meshes, move, centre, highlight, pose, size, isFar, whole, first, places, corners };
  }
})();
