// The 3D view of a recorded episode: plays its document (episode_document.py) with the links of its robot and the GLB of each twin.
// World frame, metres; a pose is seven numbers, position and quaternion wxyz, one for each state or one in all.
"use strict";
(() => {
  const viewer = document.getElementById("viewer");
  if (!viewer) return;
  const given = globalThis.manitwinGiven;
  const document_ = given(viewer.dataset.document, "json"); // the server works while the browser sets up WebGL
  document_.catch(() => {}); // told below
  const view = globalThis.manitwinStage(viewer);
  if (!view) return;
  const { THREE, scene, report, fail, quaternion, vector, draw } = view;
  const layers = {};
  for (const box of viewer.querySelectorAll("[data-layer]")) scene.add((layers[box.dataset.layer] = new THREE.Group()));
  const box = (name) => viewer.querySelector(`[data-layer="${name}"]`);
  const act = (name) => viewer.querySelector(`[data-act="${name}"]`);
  const slider = viewer.querySelector(".player input");
  const output = viewer.querySelector("output");
  const solid = (color, more) => new THREE.MeshStandardMaterial({ color, roughness: 0.8, ...more });
  const moving = []; // groups and their poses
  let told, timeline, granules;
  let state = 0;
  let playing = false;

  function pose(group, poses, at = 0) {
    const from = poses.length > 7 ? 7 * at : 0;
    group.position.copy(vector(poses, from));
    group.quaternion.copy(quaternion(poses.slice(from + 3, from + 7))).normalize();
    return group;
  }
  function posed(group, poses, label) {
    group.userData.label = label;
    if (poses.length > 7) moving.push([group, poses]);
    return pose(group, poses);
  }
  function addBoxes(boxes, color) {
    for (const each of boxes) {
      const mesh = new THREE.Mesh(new THREE.BoxGeometry(...each.half_extents_m.map((half) => 2 * half)), solid(each.color || color));
      if (each.poses) pose(mesh, each.poses);
      else mesh.position.copy(vector(each.center_m));
      mesh.userData.label = each.name;
      layers.furniture.add(mesh);
    }
  }
  function addPath(tip) {
    const points = [];
    for (let at = 0; at < tip.length; at += 7) points.push(vector(tip, at));
    layers.path.add(new THREE.Line(new THREE.BufferGeometry().setFromPoints(points), new THREE.LineBasicMaterial({ color: 0xd1652c })));
    layers.path.add(posed(new THREE.AxesHelper(0.05), tip, "tool"));
  }
  function addGranules() {
    granules = new THREE.InstancedMesh(new THREE.SphereGeometry(told.granules.radius_m, 10, 8), solid(0xcd963c), told.granules.count);
    granules.frustumCulled = false; // it is made where the first of them are
    granules.userData.label = "granules";
    layers.mesh.add(granules);
  }
  function placeGranules(at) {
    const matrix = new THREE.Matrix4();
    for (let each = 0; each < told.granules.count; each++) {
      const from = 3 * (at * told.granules.count + each);
      granules.setMatrixAt(each, matrix.setPosition(...told.granules.positions_m.slice(from, from + 3)));
    }
    granules.instanceMatrix.needsUpdate = true;
  }
  async function addRobot(robot) {
    const groups = robot.links.map((link) => posed(new THREE.Group(), link.poses, `${robot.name}: ${link.name}`));
    layers.robot.add(...groups);
    try {
      const model = await view.parsed(await given(robot.model, "arrayBuffer"));
      const materials = new Set(model.children.map((part) => part.material)); // parts share them
      for (const each of materials) each.color.multiplyScalar(0.7); // white would be as bright as what is behind it
      for (const part of [...model.children]) {
        const group = groups[Number((/^l(\d+)p/.exec(part.name) || [])[1])];
        if (!group) continue;
        const upright = new THREE.Group();
        upright.rotation.copy(model.rotation);
        group.add(upright.add(part));
      }
      show(state);
    } catch (error) {
      fail(`The robot's links cannot be shown: ${words(error)}`);
    }
  }
  const words = (error) => String((error && error.message) || error).slice(0, 200);
  async function addObjects(objects) {
    const byModel = new Map();
    objects.forEach((object, number) => {
      const group = posed(new THREE.Group(), object.poses, object.label);
      layers.mesh.add(group);
      if (object.model) byModel.set(object.model, [...(byModel.get(object.model) || []), [group, number]]);
      else group.add(marker());
    });
    await Promise.all([...byModel].map(async ([model, all]) => {
      try {
        const shape = await view.parsed(await given(model, "arrayBuffer"));
        for (const [group, number] of all) {
          group.add(shape.clone());
          if (told.goal && number === told.target) layers.goal.add(pose(new THREE.Group(), told.goal).add(ghost(shape.clone())));
        }
      } catch (error) {
        for (const [group] of all) group.add(marker());
        fail(`${objects[all[0][1]].twin_id}: visual.glb cannot be shown: ${words(error)}`);
      }
      show(state);
    }));
  }
  // what stands for an object without its mesh
  const marker = () => new THREE.Group().add(new THREE.Mesh(new THREE.SphereGeometry(0.015, 16, 12), solid(0x8c93b8)), new THREE.AxesHelper(0.06));
  function ghost(shape) {
    const glass = new THREE.MeshBasicMaterial({ color: 0x2f9e6d, transparent: true, opacity: 0.3, depthWrite: false });
    shape.traverse((each) => each.isMesh && (each.material = glass));
    shape.userData.label = "goal";
    return shape;
  }
  function showLayers() {
    for (const name of Object.keys(layers)) layers[name].visible = box(name).checked;
    draw();
  }
  const during = (spans, time) => (spans.findLast((span) => span.from_s <= time + 1e-6) || { label: "–" }).label;
  function readout(time) {
    const rows = [["phase", during(told.phases, time)]];
    if (told.literals.length) rows.push(["goal", during(told.literals, time)]);
    for (const { name, is_opening, values } of told.hands) rows.push([name, is_opening ? `${(1000 * values[state]).toFixed(1)} mm` : values[state].toFixed(3)]);
    rows.push(["force on the object", told.forces_n.map((side) => `${side[state].toFixed(1)} N`).join(", ")]);
    viewer.querySelector(".readout").replaceChildren(...rows.map(([name, value]) => {
      const row = document.createElement("div");
      const [dt, dd] = ["dt", "dd"].map((tag) => document.createElement(tag));
      dt.textContent = name;
      dd.textContent = value;
      row.append(dt, dd);
      return row;
    }));
  }
  function show(at) {
    state = Math.min(Math.max(at, 0), told.time_s.length - 1);
    const time = told.time_s[state];
    for (const [group, poses] of moving) pose(group, poses, state);
    if (granules) placeGranules(state);
    slider.value = state;
    slider.setAttribute("aria-valuetext", `${time.toFixed(2)} seconds`);
    output.textContent = `${time.toFixed(2)} / ${told.time_s[told.time_s.length - 1].toFixed(2)} s`;
    timeline.show(state);
    readout(time);
    for (const each of viewer.querySelectorAll(".happenings button")) {
      each.setAttribute("aria-current", String(Number(each.dataset.time) <= time + 1e-6));
    }
    draw();
  }
  const stateAt = (time) => Math.max(0, told.time_s.findLastIndex((each) => each <= time + 1e-6));
  function step(by) {
    pause();
    show(state + by);
    view.remember();
  }
  function seek(time) {
    pause();
    show(stateAt(time + 0.5 / told.rate_hz));
    view.remember();
  }
  function pause() {
    playing = false;
    act("play").textContent = "Play";
  }
  function play() {
    if (playing) {
      pause();
      view.remember();
      return;
    }
    const last = told.time_s.length - 1;
    if (state === last) show(0);
    playing = true;
    act("play").textContent = "Pause";
    let before;
    let time = told.time_s[state];
    requestAnimationFrame(function frame(now) {
      if (!playing) return;
      time += before === undefined ? 0 : (Math.min(now - before, 250) / 1000) * Number(act("speed").value);
      before = now;
      const at = stateAt(time);
      if (at !== state) show(at);
      if (at < last) {
        requestAnimationFrame(frame);
        return;
      }
      pause();
      view.remember();
    });
  }
  function faster(by) {
    const speed = act("speed");
    speed.selectedIndex = Math.min(Math.max(speed.selectedIndex + by, 0), speed.options.length - 1);
  }
  function listHappenings() {
    viewer.querySelector(".happenings").replaceChildren(...told.happenings.map((each) => {
      const item = document.createElement("li");
      const button = document.createElement("button");
      button.type = "button";
      button.dataset.time = each.time_s;
      button.classList.toggle("bad", each.kind === "contact");
      const when = document.createElement("b");
      when.textContent = `${each.time_s.toFixed(2)} s`;
      button.append(when, ` ${each.label}`);
      button.addEventListener("click", () => seek(each.time_s));
      item.append(button);
      return item;
    }));
  }
  function lookFrom() {
    const bounds = new THREE.Box3().expandByPoint(new THREE.Vector3(0, 0, 0.1));
    const bases = told.robots.flatMap((each) => each.links.slice(0, 1).map((link) => link.poses));
    for (const poses of [...bases, ...told.tips, ...told.objects.map((each) => each.poses)]) {
      for (let at = 0; at < poses.length; at += 7) bounds.expandByPoint(vector(poses, at));
    }
    const middle = bounds.getCenter(new THREE.Vector3());
    const far = 1.15 * bounds.getSize(new THREE.Vector3()).length() + 0.75;
    let across = 0;
    for (let at = 1; at < told.tips[0].length; at += 7) across += told.tips[0][at];
    const side = across > 0 ? 0.66 : -0.66; // where the hand works: it is before the arm then
    const [ahead, beside] = bases.length > 1 ? [0.1, -1] : [0.72, side]; // two arms that face each other: from their side
    view.setHome([middle.x + ahead * far, middle.y + beside * far, middle.z + 0.48 * far, middle.x, middle.y, middle.z]);
  }
  function listen() {
    const keys = {
      " ": play, ",": () => step(-1), ".": () => step(1), "[": () => faster(-1), "]": () => faster(1),
      Home: () => step(-told.time_s.length), End: () => step(told.time_s.length),
    };
    for (const each of viewer.querySelectorAll("[data-layer]")) {
      keys[each.parentElement.querySelector("kbd").textContent.toLowerCase()] = () => {
        each.checked = !each.checked;
        each.dispatchEvent(new Event("change", { bubbles: true }));
      };
    }
    slider.max = told.time_s.length - 1;
    for (const each of viewer.querySelectorAll(".player :disabled")) each.disabled = false;
    slider.addEventListener("input", () => (pause(), show(Number(slider.value))));
    slider.addEventListener("change", () => view.remember());
    act("play").addEventListener("click", play);
    act("back").addEventListener("click", () => step(-1));
    act("on").addEventListener("click", () => step(1));
    viewer.querySelector(".layers").addEventListener("change", () => (showLayers(), view.remember()));
    view.kept((kept) => {
      const on = kept.get("layers");
      if (on !== null) for (const name of Object.keys(layers)) box(name).checked = on.split(" ").includes(name);
      const time = Number(kept.get("t"));
      if (Number.isFinite(time)) show(stateAt(time));
    }, () => ({ t: told.time_s[state].toFixed(2), layers: Object.keys(layers).filter((name) => box(name).checked).join(" ") }));
    view.listen(keys);
  }
  async function begin() {
    try {
      told = await document_;
    } catch (error) {
      fail(`The episode cannot be shown: ${error.message}`);
      return;
    }
    told.unreadable.forEach(fail);
    addBoxes(told.furniture, "#b9b3a8");
    addBoxes(told.fixtures, "#9aa3ab");
    told.tips.forEach(addPath);
    if (told.granules) addGranules();
    timeline = globalThis.manitwinTimeline(viewer.querySelector(".timeline"), told, seek);
    listHappenings();
    lookFrom();
    listen();
    showLayers();
    show(state);
    await Promise.all([...told.robots.map(addRobot), addObjects(told.objects)]);
    requestAnimationFrame(() => requestAnimationFrame(() => {
      viewer.dataset.ready = String(Math.round(performance.now()));
      if (!view.problems.length) report("Drag to turn, scroll for nearer; point at anything for its name.");
    }));
  }
  begin();
})();
