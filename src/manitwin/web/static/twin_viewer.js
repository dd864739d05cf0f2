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
  // asked for at once: the server works while the browser sets up WebGL
  const given = (name, how, asked = "") => globalThis.manitwinGiven(viewer.dataset[name] + asked, how);
  const document_ = given("document", "json");
  const model = given("model", "arrayBuffer");
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
  scene.add((layers.cube = new THREE.Group()), (layers.gripper = new THREE.Group()));
  const shapes = globalThis.manitwinShapes(view, layers, object);

  let twin;
  let forks = null; // the one instanced mesh of a gripper's grasps
  let shown = []; // the grasps that are drawn, as places in their columns
  let chosen = -1;
  const hidden = new Set(); // outcomes

  const solid = (color, more) => new THREE.MeshStandardMaterial({ color, roughness: 0.7, ...more });

  // ---- grasps
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
  // the open hand, fingertips on the ground, on the other side than the cube
  function standGripper() {
    layers.gripper.clear();
    const name = control("gripper").value;
    if (!name || !twin.grippers[name].hand.length) return;
    const widest = Math.max(...twin.grasps[name].width_m.filter((width) => width !== null), 0.04);
    const columns = { position_m: [0, 0, 0], quaternion_wxyz: [0, 1, 0, 0], width_m: [widest] };
    const hand = shapes.boxes(twin.grippers[name].hand, [0], columns, solid(0x8d959e, { transparent: true, opacity: 0.6 }));
    hand.computeBoundingBox();
    const { min, max } = hand.boundingBox;
    const beside = (twin.extents_m[0] + max.x - min.x) / 2 + 0.05;
    hand.position.set(-beside, 0, -min.z);
    hand.userData.label = () => `${name}, open as wide as its widest grasp`;
    layers.gripper.add(hand);
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
    forks = shapes.boxes(fork, shown, columns, solid(0xffffff));
    shown.forEach((place, at) => {
      for (let part = 0; part < fork.length; part += 1) forks.setColorAt(at * fork.length + part, graspColor(columns, place));
    });
    const told = (instance) => shown[Math.floor(instance / fork.length)];
    forks.userData.label = (instance) => graspLabel(columns, told(instance));
    forks.userData.pick = (instance) => columns.id[told(instance)];
    layers.grasps.add(forks);
    if (chosen >= 0 && chosen < columns.id.length) {
      const whole = shapes.boxes(hand.length ? hand : fork, [chosen], columns, solid(graspColor(columns, chosen), { transparent: true, opacity: 0.55 }));
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
    standGripper();
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
    if (trial && trial.isOpen()) layers.grasps.visible = false; // the hand is the one that moves
    if (layerBox("wireframe").checked) shapes.addWireframe();
    draw();
  }
  function choose(step) {
    const columns = twin.grasps[control("gripper").value];
    if (!columns || !shown.length) return;
    const at = shown.indexOf(chosen);
    take(shown[at < 0 ? (step > 0 ? 0 : shown.length - 1) : (at + step + shown.length) % shown.length]);
  }
  function take(place) {
    chosen = place;
    report(graspLabel(twin.grasps[control("gripper").value], chosen));
    drawGrasps();
    if (trial && trial.isOpen()) trial.open(grasp());
    view.remember();
  }
  function grasp() {
    const gripper = control("gripper").value;
    return { gripper, id: twin.grasps[gripper].id[chosen] };
  }

  // ---- the trial of the chosen grasp
  const trial = globalThis.manitwinTrial(viewer, view, object, {
    chosen: () => {
      if (chosen < 0) choose(1);
      return chosen < 0 ? null : grasp();
    },
    document: ({ gripper, id }) => given("trial", "json", `?${new URLSearchParams({ gripper, grasp: id })}`),
    color: (outcome) => COLORS[outcome] ?? 0x888888,
    frame: (told) => {
      const size = Math.hypot(...twin.extents_m);
      const rises = told.hand.length > 7 ? Math.max(...told.hand.filter((_, at) => at % 7 === 2)) - told.hand[2] : 0;
      const far = 1.8 * (size + rises) + 0.2;
      const middle = (twin.extents_m[2] + rises) / 2;
      return [0.5 * far, -0.75 * far, middle + 0.3 * far, 0, 0, middle];
    },
    opened: (is) => {
      control("placement").disabled = is;
      if (!is) place();
      showLayers();
    },
    remember: () => view.remember(),
  });
  function step(name, by) {
    const field = control(name);
    if (name === "count") field.value = Math.max(0, Number(field.value) + by);
    else field.selectedIndex = (field.selectedIndex + by) % field.length;
    field.dispatchEvent(new Event("input", { bubbles: true }));
  }
  const KEYS = {
    "[": () => step("count", -5), "]": () => step("count", 5), n: () => choose(1), N: () => choose(-1),
    l: () => control("placement").disabled || step("placement", 1), k: () => step("color", 1),
    t: () => trial && trial.toggle(), T: () => trial && trial.close(),
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
        if (trial) trial.close();
        chosen = -1;
        fillGripper();
      } else if (name === "placement") place();
      else if (name) drawGrasps();
      if (name) view.remember();
    });
    document.addEventListener("twin:picked", ({ detail }) => {
      const columns = twin.grasps[control("gripper").value];
      const place = columns ? columns.id.indexOf(detail) : -1;
      if (place >= 0) take(place);
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
    if (trial && trial.isOpen()) state.set("trial", trial.time().toFixed(2));
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
    const at = Number.parseFloat(state.get("trial") ?? "");
    const columns = twin.grasps[control("gripper").value];
    if (trial && Number.isFinite(at) && columns && columns.id[chosen] !== undefined) trial.open(grasp(), at);
  }

  // ---- loading
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
    shapes.addHulls(twin);
    shapes.addPoints(twin, size);
    shapes.addScale(twin, size);
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
      if (view.problems.length || (trial && trial.isOpen())) return;
      const columns = twin.grasps[control("gripper").value];
      if (columns && columns.id[chosen] !== undefined) report(graspLabel(columns, chosen));
      else report("Drag to turn, scroll for nearer; point at anything for its name.");
    }));
  }
  begin();
})();
