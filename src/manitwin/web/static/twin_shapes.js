// The shapes of a twin beside its mesh: wireframe, hulls, points with their frames, grippers, and things of known size beside it.
// Metres, the object frame; texts are only ever set as textContent.
"use strict";
globalThis.manitwinShapes = (view, layers, object) => {
  const { THREE, scene, quaternion, vector } = view;
  const POINTS = { candidate: [0x7c858f, 0.009], functional: [0xd62728, 0.013], grasp: [0x1f77b4, 0.013] };
  const solid = (color, more) => new THREE.MeshStandardMaterial({ color, roughness: 0.7, ...more });
  function addWireframe() {
    if (layers.wireframe.children.length) return;
    const lines = new THREE.MeshBasicMaterial({ color: 0x5577aa, wireframe: true, transparent: true, opacity: 0.5 });
    layers.mesh.updateWorldMatrix(true, true);
    const inverse = object.matrixWorld.clone().invert();
    layers.mesh.traverse((each) => {
      if (!each.isMesh) return;
      const copy = new THREE.Mesh(each.geometry, lines);
      copy.applyMatrix4(inverse.clone().multiply(each.matrixWorld));
      layers.wireframe.add(copy);
    });
  }
  function addHulls(twin) {
    twin.hulls.forEach((hull, place) => {
      const shape = new THREE.BufferGeometry();
      shape.setAttribute("position", new THREE.Float32BufferAttribute(hull.vertices, 3));
      shape.setIndex(hull.faces);
      const color = new THREE.Color().setHSL((place * 0.381966) % 1, 0.55, 0.55);
      layers.hulls.add(new THREE.Mesh(shape, solid(color, { flatShading: true, transparent: true, opacity: 0.6, depthWrite: false })));
    });
  }
  function addPoints(twin, size) {
    for (const [kind, [color, share]] of Object.entries(POINTS)) {
      const points = twin.points.filter((point) => point.kind === kind);
      if (!points.length) continue;
      const radius = share * size;
      const mesh = new THREE.InstancedMesh(new THREE.SphereGeometry(radius, 14, 10), solid(color), points.length);
      points.forEach((point, place) => mesh.setMatrixAt(place, new THREE.Matrix4().setPosition(vector(point.position_m))));
      mesh.userData.label = (place) => points[place].label;
      mesh.userData.pick = (place) => points[place].id;
      mesh.userData.normals = points.map((point) => vector(point.normal)); // they are small: near is meant as well
      layers[kind].add(mesh);
      for (const { frame } of points.filter((point) => point.frame)) {
        const axes = new THREE.AxesHelper(0.12 * size);
        axes.position.copy(vector(frame.position_m));
        axes.quaternion.copy(quaternion(frame.quaternion_wxyz));
        layers[kind].add(axes);
      }
    }
    const mass = new THREE.Mesh(new THREE.SphereGeometry(0.014 * size, 16, 12), solid(0xff9900, { depthTest: false, transparent: true }));
    mass.position.copy(vector(twin.center_of_mass_m));
    mass.renderOrder = 2;
    mass.userData.label = () => "centre of mass";
    layers.mass.add(mass);
  }
  function addScale(twin, size) {
    const box = new THREE.BoxGeometry(0.1, 0.1, 0.1);
    const cube = new THREE.Mesh(box, solid(0x8d959e, { transparent: true, opacity: 0.25, depthWrite: false }));
    cube.add(new THREE.LineSegments(new THREE.EdgesGeometry(box), new THREE.LineBasicMaterial({ color: 0x8d959e })));
    const beside = Math.max(twin.extents_m[0], twin.extents_m[1]) / 2 + 0.07;
    cube.position.set(0.8 * beside, 0.8 * beside, 0.05); // behind, seen from the front
    cube.userData.label = () => "10 cm cube";
    layers.cube.add(cube);
    const cells = Math.max(4, Math.ceil(size / 0.1) * 2 + 2);
    const grid = new THREE.GridHelper(cells * 0.1, cells, 0x8d959e, 0x8d959e);
    grid.rotation.x = Math.PI / 2;
    grid.material.transparent = true;
    grid.material.opacity = 0.35;
    scene.add(grid);
    view.stage.querySelector(".scale").textContent = "grid: 10 cm";
  }
  // boxes of grippers at grasps, as one instanced mesh
  function boxMatrix(box, width, pose) {
    const center = vector(box.center).setX(box.center[0] + box.shift * width);
    const half = vector(box.half).setX(box.half[0] + box.grow * width);
    return new THREE.Matrix4().compose(center, quaternion(box.quaternion), half.multiplyScalar(2)).premultiply(pose);
  }
  function pose(columns, place) {
    const q = columns.quaternion_wxyz.slice(4 * place, 4 * place + 4);
    return new THREE.Matrix4().compose(vector(columns.position_m, 3 * place), quaternion(q), new THREE.Vector3(1, 1, 1));
  }
  function boxes(list, places, columns, material) {
    const mesh = new THREE.InstancedMesh(new THREE.BoxGeometry(1, 1, 1), material, Math.max(1, list.length * places.length));
    mesh.count = list.length * places.length;
    places.forEach((place, at) => {
      const gripperToObject = pose(columns, place);
      list.forEach((box, part) =>
        mesh.setMatrixAt(at * list.length + part, boxMatrix(box, columns.width_m[place] || 0, gripperToObject)));
    });
    mesh.frustumCulled = false;
    return mesh;
  }
  return { addWireframe, addHulls, addPoints, addScale, boxes };
};
