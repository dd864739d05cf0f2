// The 3D view of a twin: draws its document (twin_document.py) and its GLB with three.js. All lengths are metres, the object frame
// has +Z up, quaternions of the document are wxyz. Texts are only ever set as textContent.
"use strict";
(() => {
  const viewer = document.getElementById("viewer");
  if (!viewer) return;
  const control = (name) => viewer.querySelector(`[data-control="${name}"]`);
  const COLORS = {
    held: 0x228833, slips: 0xccbb44, drops: 0xee6677, misses: 0xaa3377, collides: 0x4477aa, unstable: 0x66ccee,
    penetrates: 0x994455, unreachable: 0xbbbbbb,
  }; // Tol's bright scheme
  const POINTS = { candidate: [0x7c858f, 0.009], functional: [0xd62728, 0.013], grasp: [0x1f77b4, 0.013] };
  // asked for at once: the server works while the browser sets up WebGL
  const plain = globalThis.manitwinTwin;
  const given = (name, how) => globalThis.manitwinGiven(viewer.dataset[name], how);
  const document_ = plain ? Promise.resolve(plain) : given("document", "json");
  const model = plain ? Promise.resolve().then(() => decoded(globalThis.manitwinModel)) : given("model", "arrayBuffer");
  for (const each of [document_, model]) each.catch(() => {}); // told below

  const view = globalThis.manitwinStage(viewer, 0.005, 50);
  if (!view) return;
  const { THREE, scene, report, fail, quaternion, vector, draw } = view;
  const object = new THREE.Group(); // what a placement moves
  scene.add(object);
  const layers = {};
  for (const name of ["mesh", "wireframe", "hulls", "candidate", "functional", "grasp", "grasps", "mass"]) {
    object.add((layers[name] = new THREE.Group()));
  }
  scene.add((layers.cube = new THREE.Group()));

  let twin;
  let forks = null; // the one instanced mesh of a gripper's grasps
  let shown = []; // the grasps that are drawn, as places in their columns
  let chosen = -1;
  const hidden = new Set(); // outcomes

  const solid = (color, more) => new THREE.MeshStandardMaterial({ color, roughness: 0.7, ...more });

  // ---- shapes
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
  function addHulls() {
    twin.hulls.forEach((hull, place) => {
      const shape = new THREE.BufferGeometry();
      shape.setAttribute("position", new THREE.Float32BufferAttribute(hull.vertices, 3));
      shape.setIndex(hull.faces);
      const color = new THREE.Color().setHSL((place * 0.381966) % 1, 0.55, 0.55);
      layers.hulls.add(new THREE.Mesh(shape, solid(color, { flatShading: true, transparent: true, opacity: 0.6, depthWrite: false })));
    });
  }
  function addPoints(size) {
    for (const [kind, [color, share]] of Object.entries(POINTS)) {
      const points = twin.points.filter((point) => point.kind === kind);
      if (!points.length) continue;
      const radius = share * size;
      const mesh = new THREE.InstancedMesh(new THREE.SphereGeometry(radius, 14, 10), solid(color), points.length);
      points.forEach((point, place) => mesh.setMatrixAt(place, new THREE.Matrix4().setPosition(vector(point.position_m))));
      mesh.userData.label = (place) => points[place].label;
      mesh.userData.pick = (place) => points[place].id;
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
  function addScale(size) {
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
    viewer.querySelector(".scale").textContent = "grid: 10 cm";
  }
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
  function graspColor(columns, place) {
    if (control("color").value === "outcome") return new THREE.Color(COLORS[columns.outcome[place]] ?? 0x888888);
    const share = columns.robustness[place];
    return share === null ? new THREE.Color(0x888888) : new THREE.Color().setHSL(0.33 * share, 0.75, 0.42);
  }
  function graspLabel(columns, place) {
    const parts = [columns.id[place], columns.outcome[place]];
    if (columns.robustness[place] !== null) parts.push(`robustness ${columns.robustness[place]}`);
    if (columns.width_m[place] !== null) parts.push(`${Math.round(1000 * columns.width_m[place])} mm wide`);
    if (columns.retired[place]) parts.push("retired");
    return parts.join(", ");
  }
  function drawGrasps() {
    for (const child of [...layers.grasps.children]) {
      layers.grasps.remove(child);
      child.geometry.dispose();
      child.dispose();
    }
    forks = null;
    const columns = twin.grasps[control("gripper").value];
    if (!columns) return;
    const { fork, hand } = twin.grippers[control("gripper").value];
    const open = columns.id.map((_, place) => place).filter((place) => !hidden.has(columns.outcome[place]));
    shown = open.slice(0, Number(control("count").value));
    forks = boxes(fork, shown, columns, solid(0xffffff));
    shown.forEach((place, at) => {
      for (let part = 0; part < fork.length; part += 1) forks.setColorAt(at * fork.length + part, graspColor(columns, place));
    });
    forks.userData.label = (instance) => graspLabel(columns, shown[Math.floor(instance / fork.length)]);
    layers.grasps.add(forks);
    if (chosen >= 0 && chosen < columns.id.length) {
      const whole = boxes(hand.length ? hand : fork, [chosen], columns, solid(graspColor(columns, chosen), { transparent: true, opacity: 0.55 }));
      whole.userData.label = () => graspLabel(columns, chosen);
      layers.grasps.add(whole);
    }
    const all = columns.total > columns.id.length ? ` (of ${columns.total}, the first that lie far apart)` : "";
    control("count").nextElementSibling.textContent = `${shown.length} of ${open.length}${all}`;
    draw();
  }

  // ---- controls
  function fillControls() {
    const names = Object.keys(twin.grasps);
    for (const name of names) control("gripper").add(new Option(twin.grippers[name].known ? name : `${name} (shape not known here)`, name));
    twin.placements.forEach((placement, place) => control("placement").add(new Option(`placement ${place + 1}: ${placement.label}`, place)));
    for (const name of ["gripper", "count", "color"]) control(name).disabled = !names.length;
  }
  function fillGripper(count) {
    const columns = twin.grasps[control("gripper").value];
    const legend = viewer.querySelector(".legend");
    legend.replaceChildren();
    if (!columns) return;
    control("count").max = columns.id.length;
    control("count").value = Math.min(count ?? 40, columns.id.length);
    for (const outcome of Object.keys(COLORS).filter((each) => columns.outcome.includes(each))) {
      const label = document.createElement("label");
      const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: !hidden.has(outcome) });
      const mark = document.createElement("i");
      mark.style.background = `#${COLORS[outcome].toString(16).padStart(6, "0")}`;
      box.addEventListener("change", () => {
        if (box.checked) hidden.delete(outcome);
        else hidden.add(outcome);
        drawGrasps();
        view.remember();
      });
      label.append(box, mark, ` ${outcome} ${columns.outcome.filter((each) => each === outcome).length}`);
      legend.append(label);
    }
    drawGrasps();
  }
  function place() {
    const placement = twin.placements[control("placement").value];
    object.position.copy(placement ? vector(placement.position_m) : new THREE.Vector3());
    object.quaternion.copy(placement ? quaternion(placement.quaternion_wxyz) : new THREE.Quaternion());
    draw();
  }
  function layerBox(name) {
    return viewer.querySelector(`[data-layer="${name}"]`);
  }
  function showLayers() {
    for (const name of Object.keys(layers)) layers[name].visible = layerBox(name).checked;
    if (layerBox("wireframe").checked) addWireframe();
    draw();
  }
  function choose(step) {
    const columns = twin.grasps[control("gripper").value];
    if (!columns || !shown.length) return;
    const at = shown.indexOf(chosen);
    chosen = shown[at < 0 ? (step > 0 ? 0 : shown.length - 1) : (at + step + shown.length) % shown.length];
    report(graspLabel(columns, chosen));
    drawGrasps();
  }
  function step(name, by) {
    const field = control(name);
    if (name === "count") field.value = Math.max(0, Number(field.value) + by);
    else field.selectedIndex = (field.selectedIndex + by) % field.length;
    field.dispatchEvent(new Event("input", { bubbles: true }));
  }
  const KEYS = {
    "[": () => step("count", -5), "]": () => step("count", 5), n: () => choose(1), N: () => choose(-1),
    l: () => step("placement", 1), k: () => step("color", 1),
  };
  for (const box of viewer.querySelectorAll("[data-layer]")) {
    KEYS[box.parentElement.querySelector("kbd").textContent.toLowerCase()] = () => {
      box.checked = !box.checked;
      box.dispatchEvent(new Event("change", { bubbles: true }));
    };
  }
  function listen() {
    viewer.addEventListener("change", (event) => event.target.dataset.layer && (showLayers(), view.remember()));
    viewer.addEventListener("input", (event) => {
      const name = event.target.dataset.control;
      if (name === "gripper") {
        chosen = -1;
        fillGripper();
      } else if (name === "placement") place();
      else if (name) drawGrasps();
      if (name) view.remember();
    });
    // the mesh has no name of its own, and its many triangles are not asked
    view.listen(KEYS, () => Object.entries(layers).flatMap(([name, group]) => (name === "mesh" || name === "wireframe" ? [] : group.children)));
  }

  // ---- the view in the address
  function remembered() {
    const state = new URLSearchParams();
    state.set("layers", Object.keys(layers).filter((name) => layerBox(name).checked).join(" "));
    for (const name of ["gripper", "count", "color", "placement"]) state.set(name, control(name).value);
    if (hidden.size) state.set("without", [...hidden].join(" "));
    if (chosen >= 0) state.set("grasp", chosen);
    return state;
  }
  function recall(state) {
    const on = state.get("layers");
    if (on !== null) for (const name of Object.keys(layers)) layerBox(name).checked = on.split(" ").includes(name);
    for (const name of ["gripper", "color", "placement"]) {
      const wanted = state.get(name);
      if ([...control(name).options].some((option) => option.value === wanted)) control(name).value = wanted;
    }
    for (const outcome of (state.get("without") || "").split(" ")) if (outcome in COLORS) hidden.add(outcome);
    chosen = Number.parseInt(state.get("grasp") ?? "-1", 10);
    fillGripper(state.has("count") ? Number(state.get("count")) || 0 : undefined);
    place();
    showLayers();
  }

  // ---- loading
  function decoded(base64) {
    const text = atob(base64);
    const bytes = new Uint8Array(text.length);
    for (let at = 0; at < text.length; at += 1) bytes[at] = text.charCodeAt(at);
    return bytes.buffer;
  }
  async function begin() {
    try {
      twin = await document_;
    } catch (error) {
      fail(`The twin cannot be shown: ${error.message}`);
      return;
    }
    const size = Math.max(...twin.extents_m);
    const height = twin.extents_m[2] / 2;
    const far = 2.4 * Math.hypot(...twin.extents_m) + 0.12;
    view.setHome([0.62 * far, -0.68 * far, height + 0.45 * far, 0, 0, height]);
    twin.unreadable.forEach(fail);
    addHulls();
    addPoints(size);
    addScale(size);
    fillControls();
    view.kept(recall, remembered);
    listen();
    let shape;
    try {
      shape = await model;
    } catch (error) {
      fail(`visual.glb: ${error.message}`);
    }
    if (shape) {
      try {
        layers.mesh.add(await view.parsed(shape));
      } catch (error) {
        fail(`visual.glb cannot be shown: ${String((error && error.message) || error).slice(0, 200)}`);
      }
    }
    showLayers();
    requestAnimationFrame(() => requestAnimationFrame(() => {
      viewer.dataset.ready = String(Math.round(performance.now()));
      if (!view.problems.length) report("Drag to turn, scroll for nearer; point at anything for its name.");
    }));
  }
  begin();
})();
