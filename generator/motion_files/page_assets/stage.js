// The stage: camera, lights and shadows in which bodies and props are drawn. three.js is loaded before.
"use strict";
(() => {
  const { colour, extremes } = mover;

  /** Return whether the browser can draw a stage. */
  mover.canDraw = () => Boolean(document.createElement("canvas").getContext("webgl2"));

  /** A stage on a canvas that fills its host. */
  mover.stage = (canvas, host) => {
    const renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = THREE.PCFShadowMap;
    const scene = new THREE.Scene();
    const camera = new THREE.PerspectiveCamera(32, 1, 0.01, 1000);
    const controls = new THREE.OrbitControls(camera, canvas);
    const sun = new THREE.DirectionalLight(0xffffff, 2.2);
    const recolours = [];
    let radius = 1;
    let free = 1; // share of the height below the buttons
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    sun.shadow.bias = -0.0005;
    scene.add(sun, sun.target, new THREE.HemisphereLight(0xffffff, 0x8a8378, 1.6));

    let waiting = false;
    function draw() {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        renderer.render(scene, camera);
      });
    }

    /** Add something drawn; `recolour` is called with each theme, and at once. */
    function add(object, recolour = () => {}) {
      scene.add(object);
      recolours.push(recolour);
      recolour();
    }

    function recolour() {
      scene.background = new THREE.Color(colour("--stage"));
      for (const each of recolours) each();
      draw();
    }

    /** Light a box [m] from above the left shoulder, with a shadow that covers it; `size` is that of a body. */
    function light(box, size) {
      radius = box.getSize(new THREE.Vector3()).length();
      Object.assign(sun.shadow.camera, {
        left: -radius, right: radius, top: radius, bottom: -radius, near: 0.1 * radius, far: 8 * radius,
      });
      sun.shadow.normalBias = 0.01 * size;
    }

    function aim(target) {
      sun.target.position.copy(target);
      sun.position.copy(target).addScaledVector(new THREE.Vector3(0.45, 1, 0.55), 3 * radius);
    }

    /** Move camera and light so that they look at another point, from the same side. */
    function shift(target) {
      camera.position.add(target).sub(controls.target);
      controls.target.copy(target);
      aim(target);
    }

    /**
     * Look from a direction so that all points are in the picture. Without `middle` it is theirs; with one the
     * points are relative to it.
     */
    function frame(direction, points, middle = null) {
      const back = new THREE.Vector3(...direction).normalize();
      const right = new THREE.Vector3(0, 1, 0).cross(back).normalize();
      const up = back.clone().cross(right);
      const tangent = Math.tan((camera.fov * Math.PI) / 360);
      const centre = new THREE.Vector3();
      for (const along of middle ? [] : [right, up, back]) {
        const [low, high] = extremes(points.map((point) => point.dot(along)));
        centre.addScaledVector(along, (low + high) / 2);
      }
      let distance = 1e-3;
      for (const point of points) {
        const seen = point.clone().sub(centre);
        const across = Math.max(Math.abs(seen.dot(up)) / free, Math.abs(seen.dot(right)) / camera.aspect);
        distance = Math.max(distance, seen.dot(back) + (1.12 * across) / tangent);
      }
      const target = middle ?? centre;
      controls.target.copy(target);
      camera.position.copy(target).addScaledVector(back, distance);
      camera.near = distance / 100;
      camera.far = distance * 100;
      camera.updateProjectionMatrix();
      aim(target);
      controls.update();
      draw();
    }

    function resize() {
      const { clientWidth: width, clientHeight: height } = host;
      if (!width || !height) return;
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      const buttons = host.querySelector("#camera");
      const top = Math.min(buttons.offsetTop + buttons.offsetHeight, height / 2);
      free = 1 - top / height;
      camera.setViewOffset(width, height, 0, -top / 2, width, height); // the middle is that of the free part
      draw();
    }

    /** Call `chosen` with the mesh, or undefined, below each click that is not a drag. */
    function listenToClicks(meshes, chosen) {
      let down = null;
      canvas.addEventListener("pointerdown", (event) => (down = [event.clientX, event.clientY]));
      canvas.addEventListener("pointerup", (event) => {
        if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
        const area = canvas.getBoundingClientRect();
        const place = new THREE.Vector2(
          (2 * (event.clientX - area.left)) / area.width - 1,
          1 - (2 * (event.clientY - area.top)) / area.height,
        );
        const ray = new THREE.Raycaster();
        ray.setFromCamera(place, camera);
        chosen(ray.intersectObjects(meshes, false)[0]?.object);
      });
    }

    controls.addEventListener("change", draw);
    new ResizeObserver(resize).observe(host);
    resize();
    return {
      add, draw, recolour, light, shift, frame, listenToClicks, controls,
      triangles: () => renderer.info.render.triangles,
    };
  };
})();
