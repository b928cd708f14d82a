// What is around a body on the stage: floors as grids with shadows, props, and contact forces as arrows.
"use strict";
(() => {
  const { colour, floats } = mover;

  const MAX_CELLS = 60;

  /** A grid with the shadow on it, in the plane y = 0 of its own axes. */
  function grid(stage, size, reach) {
    const cell = 10 ** Math.round(Math.log10(size / 2));
    const cells = 2 * Math.min(Math.ceil(reach / cell), MAX_CELLS);
    const group = new THREE.Group();
    const lines = new THREE.Group();
    const plane = new THREE.Mesh(
      new THREE.PlaneGeometry(cells * cell, cells * cell),
      new THREE.ShadowMaterial({ opacity: 0.22 }),
    );
    plane.rotation.x = -Math.PI / 2;
    plane.position.y = -0.002 * size;
    plane.receiveShadow = true;
    group.add(lines, plane);
    stage.add(group, () => {
      for (const old of lines.children) old.dispose();
      lines.clear();
      const strong = new THREE.Color(colour("--grid"));
      const fine = new THREE.Color(colour("--fine-grid"));
      if (cells <= 24) lines.add(new THREE.GridHelper(cells * cell, 5 * cells, fine, fine));
      lines.add(new THREE.GridHelper(cells * cell, cells, strong, strong));
      lines.children.forEach((each, k) => (each.position.y = -0.001 * size * (2 - k)));
    });
    return [group, cell];
  }

  /**
   * Add props and the ground of a body to the stage. A level plane is a grid; without one there is a grid at y = 0.
   * Return a text that says so, and the corners of the props near the body.
   */
  mover.addSurroundings = (stage, props, { size, whole }) => {
    const reach = Math.max(Math.abs(whole.min.x), whole.max.x, Math.abs(whole.min.z), whole.max.z) + 1.5 * size;
    const near = whole.clone().expandByScalar(0.35 * size);
    const corners = [];
    let floor = null;
    for (const prop of props) {
      prop.updateMatrixWorld();
      if (prop.userData.level) {
        const [group, cell] = grid(stage, size, reach);
        group.position.copy(prop.position);
        group.quaternion.copy(prop.quaternion);
        floor ??= [cell, "on the floor"];
        continue;
      }
      prop.geometry.computeBoundingBox();
      prop.castShadow = prop.receiveShadow = !prop.material.transparent;
      prop.material.depthWrite = !prop.material.transparent;
      stage.add(prop);
      if (!prop.material.transparent)
        corners.push(...mover.cornersOf(prop).map((corner) => near.clampPoint(corner, new THREE.Vector3())));
    }
    floor ??= [grid(stage, size, reach)[1], "at y = 0"];
    const [cell, where] = floor;
    const width = cell >= 1 ? `${cell} m` : `${Number((100 * cell).toPrecision(1))} cm`;
    return { text: `Grid: ${width}, ${where}`, corners };
  };

  /** Forces and points of all frames of a part, from those of the frames in which it is touched. */
  mover.forcesOf = (row, frames) => {
    const [forces, points] = [new Float32Array(3 * frames), new Float32Array(3 * frames)];
    const [values, places] = [floats(row.forces), floats(row.points)];
    floats(row.frames).forEach((frame, k) => {
      forces.set(values.subarray(3 * k, 3 * k + 3), 3 * frame);
      points.set(places.subarray(3 * k, 3 * k + 3), 3 * frame);
    });
    const size = (k) => Math.hypot(forces[3 * k], forces[3 * k + 1], forces[3 * k + 2]);
    const sizes = Float32Array.from({ length: frames }, (_, k) => size(k));
    return { name: row.name, forces, points, size, sizes, peak: Math.max(...sizes) };
  };

  const MIN_FORCE = 1;

  /**
   * Add arrows of contact forces, parts as `forcesOf` returns them, to the stage; `size` is that of the body [m],
   * `scale` has `metres_per_newton` and the `longest` arrow [m]. Arrows end where the forces act, or
   * with `begin_at_point` begin there, and are drawn over all else. Return their group, how to move and show them, and
   * the names of those that are seen, and their colour, which `tint` returns.
   */
  mover.addArrows = (stage, parts, scale, size, tint = () => colour("--force")) => {
    const material = new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.9, depthTest: false });
    const [shaft, head] = [new THREE.CylinderGeometry(1, 1, 1, 12), new THREE.CylinderGeometry(0, 1, 1, 16)];
    shaft.translate(0, 0.5, 0);
    head.translate(0, 0.5, 0);
    const group = new THREE.Group();
    const up = new THREE.Vector3(0, 1, 0);
    const arrows = parts.map((part) => {
      const arrow = new THREE.Group();
      const meshes = [shaft, head].map((geometry) => new THREE.Mesh(geometry, material));
      for (const mesh of meshes) mesh.renderOrder = 1;
      arrow.add(...meshes);
      group.add(arrow);
      return { part, arrow, meshes };
    });
    const [force, point, other] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
    stage.add(group, () => material.color.set(tint()));

    function move([low, next, share]) {
      for (const { part, arrow, meshes: [line, tip] } of arrows) {
        const [before, after] = [part.size(low), part.size(next)];
        force.fromArray(part.forces, 3 * low).lerp(other.fromArray(part.forces, 3 * next), share);
        point.fromArray(part.points, 3 * (before > 0 ? low : next));
        if (before > 0 && after > 0) point.lerp(other.fromArray(part.points, 3 * next), share);
        const newtons = force.length();
        arrow.visible = newtons >= MIN_FORCE;
        if (!arrow.visible) continue;
        const long = Math.min(scale.metres_per_newton * newtons, scale.longest);
        const top = Math.min(0.05 * size, 0.6 * long);
        force.divideScalar(newtons);
        arrow.quaternion.setFromUnitVectors(up, force);
        arrow.position.copy(point).addScaledVector(force, scale.begin_at_point ? 0 : -long);
        line.scale.set(0.005 * size, long - top, 0.005 * size);
        tip.scale.set(0.28 * top, top, 0.28 * top); // short ones are slim
        tip.position.y = long - top;
      }
    }

    return {
      group,
      move,
      show: (isShown) => (group.visible = isShown),
      visible: () => (group.visible ? arrows.filter(({ arrow }) => arrow.visible).map(({ part }) => part.name) : []),
      colour: () => material.color.getStyle(),
    };
  };
})();
