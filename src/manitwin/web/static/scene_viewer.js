// The 3D view of a scene: draws its document (scene_document.py), and the GLB of each twin where the scene has it. World frame.
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
  const solid = (color, more) => new THREE.MeshStandardMaterial({ color, roughness: 0.8, ...more });

  function showLayers() {
    for (const name of Object.keys(layers)) layers[name].visible = box(name).checked;
    draw();
  }
  function posed(group, object) {
    group.position.copy(vector(object.position_m));
    group.quaternion.copy(quaternion(object.quaternion_wxyz));
    group.userData.label = object.label;
    return group;
  }
  function addFurniture(boxes) {
    for (const each of boxes) {
      const mesh = new THREE.Mesh(new THREE.BoxGeometry(...each.half_extents_m.map((half) => 2 * half)), solid(each.color));
      mesh.position.copy(vector(each.center_m));
      mesh.userData.label = each.name;
      layers.furniture.add(mesh);
    }
  }
  function addSupports(supports) {
    for (const each of supports) {
      const [x, y] = each.half_extents_m;
      const plane = new THREE.Mesh(new THREE.PlaneGeometry(2 * x, 2 * y), solid(0x2f9e6d, { transparent: true, opacity: 0.35, depthWrite: false }));
      plane.position.copy(vector(each.center_m)).add(new THREE.Vector3(0, 0, 0.001));
      plane.userData.label = `support: ${each.name}`;
      layers.supports.add(plane);
    }
  }
  function addWorkspace(robot) {
    if (!robot) return;
    const ring = new THREE.RingGeometry(robot.min_radius_m, robot.max_radius_m, 48, 1, -robot.half_angle_rad, 2 * robot.half_angle_rad);
    const sector = new THREE.Mesh(ring, new THREE.MeshBasicMaterial({ color: 0x4477aa, transparent: true, opacity: 0.16, side: THREE.DoubleSide, depthWrite: false }));
    const outline = new THREE.LineSegments(new THREE.EdgesGeometry(ring), new THREE.LineBasicMaterial({ color: 0x4477aa }));
    const base = new THREE.Mesh(new THREE.CylinderGeometry(0.06, 0.08, 0.1, 24), solid(0x4477aa));
    base.rotation.x = Math.PI / 2;
    base.position.z = 0.05;
    base.userData.label = `base of ${robot.name}`;
    sector.position.z = outline.position.z = 0.002;
    layers.workspace.add(sector, outline, base);
  }
  function addHulls(objects, hulls) {
    for (const object of objects) {
      const group = posed(new THREE.Group(), object);
      (hulls[object.twin_id] || []).forEach((hull, place) => {
        const shape = new THREE.BufferGeometry();
        shape.setAttribute("position", new THREE.Float32BufferAttribute(hull.vertices, 3));
        shape.setIndex(hull.faces);
        const color = new THREE.Color().setHSL((place * 0.381966) % 1, 0.55, 0.55);
        group.add(new THREE.Mesh(shape, solid(color, { flatShading: true, transparent: true, opacity: 0.6, depthWrite: false })));
      });
      layers.hulls.add(group);
    }
  }
  async function addMeshes(objects) {
    const byModel = new Map();
    for (const object of objects) {
      if (object.model) byModel.set(object.model, [...(byModel.get(object.model) || []), object]);
    }
    await Promise.all([...byModel].map(async ([model, all]) => {
      try {
        const shape = await view.parsed(await given(model, "arrayBuffer"));
        for (const object of all) layers.mesh.add(posed(new THREE.Group(), object).add(shape.clone()));
        draw();
      } catch (error) {
        fail(`${all[0].twin_id}: visual.glb cannot be shown: ${String((error && error.message) || error).slice(0, 200)}`);
      }
    }));
  }
  async function begin() {
    let told;
    try {
      told = await document_;
    } catch (error) {
      fail(`The scene cannot be shown: ${error.message}`);
      return;
    }
    told.unreadable.forEach(fail);
    addFurniture(told.furniture);
    addSupports(told.supports);
    addWorkspace(told.robot);
    addHulls(told.objects, told.hulls);
    const bounds = new THREE.Box3();
    for (const object of told.objects) bounds.expandByPoint(vector(object.position_m));
    if (bounds.isEmpty()) bounds.setFromObject(layers.furniture);
    const middle = bounds.getCenter(new THREE.Vector3());
    const far = 1.5 * bounds.getSize(new THREE.Vector3()).length() + 0.5;
    view.setHome([middle.x + 0.62 * far, middle.y - 0.68 * far, middle.z + 0.6 * far, middle.x, middle.y, middle.z]);
    const keys = {};
    for (const each of viewer.querySelectorAll("[data-layer]")) {
      keys[each.parentElement.querySelector("kbd").textContent.toLowerCase()] = () => {
        each.checked = !each.checked;
        each.dispatchEvent(new Event("change", { bubbles: true }));
      };
    }
    view.kept((state) => {
      const on = state.get("layers");
      if (on !== null) for (const name of Object.keys(layers)) box(name).checked = on.split(" ").includes(name);
    }, () => ({ layers: Object.keys(layers).filter((name) => box(name).checked).join(" ") }));
    viewer.addEventListener("change", () => (showLayers(), view.remember()));
    view.listen(keys);
    showLayers();
    await addMeshes(told.objects);
    requestAnimationFrame(() => requestAnimationFrame(() => {
      viewer.dataset.ready = String(Math.round(performance.now()));
      if (!view.problems.length) report("Drag to turn, scroll for nearer; point at anything for its name.");
    }));
  }
  begin();
})();
