// The 3D view of a twin: draws its document (twin_document.py) and its GLB with three.js. All lengths are metres, the object frame
// has +Z up, quaternions of the document are wxyz. Texts are only ever set as textContent.
"use strict";
(() => {
  const viewer = document.getElementById("viewer");
  if (!viewer) return;
  const stage = viewer.querySelector(".stage");
  const tip = viewer.querySelector(".tip");
  const said = viewer.querySelector(".said");
  const control = (name) => viewer.querySelector(`[data-control="${name}"]`);
  const COLORS = {
    held: 0x228833, slips: 0xccbb44, drops: 0xee6677, misses: 0xaa3377, collides: 0x4477aa, unstable: 0x66ccee,
    penetrates: 0x994455, unreachable: 0xbbbbbb,
  }; // Tol's bright scheme
  const POINTS = { candidate: [0x7c858f, 0.009], functional: [0xd62728, 0.013], grasp: [0x1f77b4, 0.013] };
  const problems = [];

  function report(text, isError) {
    said.textContent = text;
    said.classList.toggle("error", Boolean(isError));
  }
  function fail(text) {
    problems.push(text);
    report(problems.join(" · "), true);
  }

  async function given(name, how) {
    const answer = await fetch(viewer.dataset[name]);
    if (answer.ok) return answer[how]();
    const told = new DOMParser().parseFromString(await answer.text(), "text/html").querySelector("[role=alert]");
    throw new Error(told ? told.textContent : `the server answers ${answer.status}`);
  }
  // asked for at once: the server works while the browser sets up WebGL
  const plain = globalThis.manitwinTwin;
  const document_ = plain ? Promise.resolve(plain) : given("document", "json");
  const model = plain ? Promise.resolve().then(() => decoded(globalThis.manitwinModel)) : given("model", "arrayBuffer");
  for (const each of [document_, model]) each.catch(() => {}); // told below

  const { THREE, GLTFLoader, OrbitControls } = globalThis.threeBundle || {};
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
  } catch (error) {
    fail("This browser cannot draw in 3D (WebGL is off or missing): the numbers and pictures are all here.");
    return;
  }
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  stage.prepend(renderer.domElement);
  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(35, 1, 0.005, 50);
  camera.up.set(0, 0, 1);
  const orbit = new OrbitControls(camera, renderer.domElement);
  const light = new THREE.DirectionalLight(0xffffff, 2.2);
  scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa0aa, 2.6), light);
  const object = new THREE.Group(); // what a placement moves
  scene.add(object);
  const layers = {};
  for (const name of ["mesh", "wireframe", "hulls", "candidate", "functional", "grasp", "grasps", "mass"]) {
    object.add((layers[name] = new THREE.Group()));
  }
  scene.add((layers.cube = new THREE.Group()));

  let asked = false;
  let twin;
  let home = [];
  let forks = null; // the one instanced mesh of a gripper's grasps
  let shown = []; // the grasps that are drawn, as places in their columns
  let chosen = -1;
  const hidden = new Set(); // outcomes

  function draw() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      light.position.copy(camera.position).add(new THREE.Vector3(0.2, 0.1, 0.6));
      renderer.render(scene, camera);
    });
  }
  const quaternion = (q) => new THREE.Quaternion(q[1], q[2], q[3], q[0]);
  const vector = (v, at = 0) => new THREE.Vector3(v[at], v[at + 1], v[at + 2]);
  const solid = (color, more) => new THREE.MeshStandardMaterial({ color, roughness: 0.7, ...more });

  // ---- shapes
  function addModel(buffer) {
    const manager = new THREE.LoadingManager();
    // a GLB holds all that it needs: nothing is fetched from where one points to
    manager.setURLModifier((url) => (/^(blob|data):/.test(url) ? url : "data:,"));
    return new Promise((resolve) => {
      const broken = (error) => {
        fail(`visual.glb cannot be shown: ${String((error && error.message) || error).slice(0, 200)}`);
        resolve();
      };
      try {
        new GLTFLoader(manager).parse(buffer, "", (gltf) => {
          const model = gltf.scene;
          model.rotation.x = Math.PI / 2; // GLB is Y-up
          model.traverse((each) => {
            for (const material of [].concat(each.material || [])) {
              if (material.metalness > 0.4) material.metalness = 0.4; // there are no surroundings that it could mirror
            }
          });
          layers.mesh.add(model);
          resolve();
        }, broken);
      } catch (error) {
        broken(error);
      }
    });
  }
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
        remember();
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
  function turn(azimuth, polar, zoom = 1) {
    const offset = camera.position.clone().sub(orbit.target).multiplyScalar(zoom);
    offset.applyAxisAngle(camera.up, azimuth);
    const side = new THREE.Vector3().crossVectors(camera.up, offset).normalize();
    const above = offset.clone().applyAxisAngle(side, polar);
    if (above.angleTo(camera.up) > 0.05 && above.angleTo(camera.up) < 3.09 && above.dot(offset) > 0) offset.copy(above);
    camera.position.copy(orbit.target).add(offset);
    orbit.update();
    draw();
    remember();
  }
  function step(name, by) {
    const field = control(name);
    if (name === "count") field.value = Math.max(0, Number(field.value) + by);
    else field.selectedIndex = (field.selectedIndex + by) % field.length;
    field.dispatchEvent(new Event("input", { bubbles: true }));
  }
  const KEYS = {
    ArrowLeft: () => turn(-0.15, 0), ArrowRight: () => turn(0.15, 0), ArrowUp: () => turn(0, -0.12), ArrowDown: () => turn(0, 0.12),
    "+": () => turn(0, 0, 0.85), "=": () => turn(0, 0, 0.85), "-": () => turn(0, 0, 1.18), "−": () => turn(0, 0, 1.18),
    0: () => look(home), "[": () => step("count", -5), "]": () => step("count", 5), n: () => choose(1), N: () => choose(-1),
    l: () => step("placement", 1), k: () => step("color", 1),
  };
  for (const box of viewer.querySelectorAll("[data-layer]")) {
    KEYS[box.parentElement.querySelector("kbd").textContent.toLowerCase()] = () => {
      box.checked = !box.checked;
      box.dispatchEvent(new Event("change", { bubbles: true }));
    };
  }
  function listen() {
    stage.addEventListener("keydown", (event) => {
      const act = event.ctrlKey || event.altKey || event.metaKey ? null : KEYS[event.key];
      if (!act) return;
      event.preventDefault();
      act();
    });
    viewer.addEventListener("change", (event) => event.target.dataset.layer && (showLayers(), remember()));
    viewer.addEventListener("input", (event) => {
      const name = event.target.dataset.control;
      if (name === "gripper") {
        chosen = -1;
        fillGripper();
      } else if (name === "placement") place();
      else if (name) drawGrasps();
      if (name) remember();
    });
    orbit.addEventListener("change", draw);
    orbit.addEventListener("end", remember);
    const ray = new THREE.Raycaster();
    stage.addEventListener("pointerleave", () => (tip.hidden = true));
    const under = (event, wanted) => {
      const area = stage.getBoundingClientRect();
      const x = event.clientX - area.left;
      const y = event.clientY - area.top;
      ray.setFromCamera(new THREE.Vector2((2 * x) / area.width - 1, 1 - (2 * y) / area.height), camera);
      const targets = [];
      for (const group of Object.values(layers)) if (group.visible) targets.push(...group.children);
      return [ray.intersectObjects(targets, false).find((each) => each.object.userData[wanted]), area, x, y];
    };
    stage.addEventListener("click", (event) => {
      const [hit] = under(event, "pick"); // a page that moves points listens
      if (hit) stage.dispatchEvent(new CustomEvent("twin:picked", { bubbles: true, detail: hit.object.userData.pick(hit.instanceId) }));
    });
    stage.addEventListener("pointermove", (event) => {
      const [hit, area, x, y] = under(event, "label");
      tip.hidden = !hit;
      if (!hit) return;
      tip.textContent = hit.object.userData.label(hit.instanceId);
      tip.style.left = `${Math.min(x + 12, area.width - tip.offsetWidth - 4)}px`;
      tip.style.top = `${Math.min(y + 12, area.height - tip.offsetHeight - 4)}px`;
    });
    renderer.domElement.addEventListener("webglcontextlost", () => fail("The browser has taken the 3D view's memory away: reload the page."));
    new ResizeObserver(resize).observe(stage);
  }
  function resize() {
    const { clientWidth, clientHeight } = stage;
    if (!clientWidth || !clientHeight) return;
    renderer.setSize(clientWidth, clientHeight, false);
    renderer.domElement.style.width = `${clientWidth}px`;
    renderer.domElement.style.height = `${clientHeight}px`;
    camera.aspect = clientWidth / clientHeight;
    camera.updateProjectionMatrix();
    draw();
  }

  // ---- the view in the address
  function look(numbers) {
    camera.position.set(...numbers.slice(0, 3));
    orbit.target.set(...numbers.slice(3));
    orbit.update();
    draw();
  }
  function remember() {
    const state = new URLSearchParams();
    state.set("layers", Object.keys(layers).filter((name) => layerBox(name).checked).join(" "));
    for (const name of ["gripper", "count", "color", "placement"]) state.set(name, control(name).value);
    if (hidden.size) state.set("without", [...hidden].join(" "));
    if (chosen >= 0) state.set("grasp", chosen);
    state.set("from", [...camera.position.toArray(), ...orbit.target.toArray()].map((each) => each.toFixed(3)).join(" "));
    history.replaceState(null, "", `#${state}`);
  }
  function recall() {
    const state = new URLSearchParams(location.hash.slice(1));
    const on = state.get("layers");
    if (on !== null) for (const name of Object.keys(layers)) layerBox(name).checked = on.split(" ").includes(name);
    for (const name of ["gripper", "color", "placement"]) {
      const wanted = state.get(name);
      if ([...control(name).options].some((option) => option.value === wanted)) control(name).value = wanted;
    }
    for (const outcome of (state.get("without") || "").split(" ")) if (outcome in COLORS) hidden.add(outcome);
    chosen = Number.parseInt(state.get("grasp") ?? "-1", 10);
    const from = (state.get("from") || "").split(" ").map(Number);
    look(from.length === 6 && from.every(Number.isFinite) ? from : home);
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
    home = [0.62 * far, -0.68 * far, height + 0.45 * far, 0, 0, height];
    twin.unreadable.forEach(fail);
    addHulls();
    addPoints(size);
    addScale(size);
    fillControls();
    listen();
    resize();
    recall();
    try {
      await addModel(await model);
    } catch (error) {
      fail(`visual.glb: ${error.message}`);
    }
    showLayers();
    requestAnimationFrame(() => requestAnimationFrame(() => {
      viewer.dataset.ready = String(Math.round(performance.now()));
      if (!problems.length) report("Drag to turn, scroll for nearer; point at anything for its name.");
    }));
  }
  begin();
})();
