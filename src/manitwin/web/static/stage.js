// What 3D views share: the renderer and its camera, turned by mouse and keys, and names on hover. Metres, +Z up, quaternions wxyz.
// Texts are only ever set as textContent.
"use strict";
// what a server is asked for, or, of plain files, what scripts have set by its name: browsers read nothing else from a disk
globalThis.manitwinGiven = async (address, how) => {
  const files = globalThis.manitwinFiles;
  if (files) {
    const name = address.replace(/^(\.\.\/)+/, "");
    if (!Object.hasOwn(files, name)) throw new Error("it is not among these files");
    const found = files[name];
    return how === "json" ? found : Uint8Array.from(atob(found), (each) => each.charCodeAt(0)).buffer;
  }
  const answer = await fetch(address);
  if (answer.ok) return answer[how]();
  const told = new DOMParser().parseFromString(await answer.text(), "text/html").querySelector("[role=alert]");
  throw new Error(told ? told.textContent : `the server answers ${answer.status}`);
};
globalThis.manitwinStage = (viewer, near = 0.01, far = 100) => {
  const stage = viewer.querySelector(".stage");
  const tip = viewer.querySelector(".tip");
  const said = viewer.querySelector(".said");
  const problems = [];
  function report(text, isError) {
    said.textContent = text;
    said.classList.toggle("error", Boolean(isError));
  }
  function fail(text) {
    problems.push(text);
    report(problems.join(" · "), true);
  }
  const { THREE, GLTFLoader, OrbitControls } = globalThis.threeBundle || {};
  let renderer;
  try {
    // of its size from the beginning: to change it takes as long as to make it, where there is no GPU
    const canvas = document.createElement("canvas");
    canvas.width = stage.clientWidth || 300;
    canvas.height = stage.clientHeight || 150;
    renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
  } catch (error) {
    fail("This browser cannot draw in 3D (WebGL is off or missing): all else is here.");
    return null;
  }
  if (Math.min(devicePixelRatio, 2) !== 1) renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  stage.prepend(renderer.domElement);
  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(35, 1, near, far);
  camera.up.set(0, 0, 1);
  const orbit = new OrbitControls(camera, renderer.domElement);
  const light = new THREE.DirectionalLight(0xffffff, 2.2);
  scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa0aa, 2.6), light);
  const quaternion = (q) => new THREE.Quaternion(q[1], q[2], q[3], q[0]);
  const vector = (v, at = 0) => new THREE.Vector3(v[at], v[at + 1], v[at + 2]);
  const ray = new THREE.Raycaster();
  ray.params.Line.threshold = 0.003; // metres; of three.js one, so that every ray meets the edges of what stands nearby
  let asked = false;
  let home = [1, -1, 1, 0, 0, 0];
  let remember = () => {};
  function draw() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      light.position.copy(camera.position).add(new THREE.Vector3(0.2, 0.1, 0.6));
      renderer.render(scene, camera);
    });
  }
  function look(numbers) {
    camera.position.set(...numbers.slice(0, 3));
    orbit.target.set(...numbers.slice(3));
    orbit.update();
    draw();
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
  function resize() {
    const { clientWidth, clientHeight } = stage;
    if (!clientWidth || !clientHeight) return;
    const now = renderer.getSize(new THREE.Vector2());
    if (now.x !== clientWidth || now.y !== clientHeight) renderer.setSize(clientWidth, clientHeight, false);
    renderer.domElement.style.width = `${clientWidth}px`;
    renderer.domElement.style.height = `${clientHeight}px`;
    camera.aspect = clientWidth / clientHeight;
    camera.updateProjectionMatrix();
    draw();
  }
  // a GLB holds all that it needs: nothing is fetched from where one points to
  function parsed(buffer) {
    const manager = new THREE.LoadingManager();
    manager.setURLModifier((url) => (/^(blob|data):/.test(url) ? url : "data:,"));
    return new Promise((resolve, reject) => {
      try {
        new GLTFLoader(manager).parse(buffer, "", (gltf) => {
          const model = gltf.scene;
          model.rotation.x = Math.PI / 2; // GLB is Y-up
          model.traverse((each) => {
            for (const material of [].concat(each.material || [])) {
              if (material.metalness > 0.4) material.metalness = 0.4; // there are no surroundings that it could mirror
            }
          });
          resolve(model);
        }, reject);
      } catch (error) {
        reject(error);
      }
    });
  }
  // what is under the pointer with something of a name among its own or its parents' user data, and what that is
  function under(event, name, targets) {
    const area = stage.getBoundingClientRect();
    const x = event.clientX - area.left;
    const y = event.clientY - area.top;
    ray.setFromCamera(new THREE.Vector2((2 * x) / area.width - 1, 1 - (2 * y) / area.height), camera);
    for (const hit of ray.intersectObjects(targets(), true)) {
      const found = ofOne(hit.object, name);
      if (found !== undefined) return { told: typeof found === "function" ? found(hit.instanceId) : found, area, x, y };
    }
    return { told: nearby(name, targets(), area, x, y, event.pointerType === "touch" ? 16 : 8), area, x, y };
  }
  // points are a few pixels wide: the name of the nearest within so many pixels that faces the camera, as its normal says
  function nearby(name, targets, area, x, y, reach) {
    let told;
    let least = reach;
    const matrix = new THREE.Matrix4();
    for (const each of targets) {
      const found = each.userData.normals && ofOne(each, name);
      if (!found) continue;
      each.userData.normals.forEach((normal, place) => {
        each.getMatrixAt(place, matrix);
        const point = new THREE.Vector3().setFromMatrixPosition(matrix).applyMatrix4(each.matrixWorld);
        const outwards = normal.clone().transformDirection(each.matrixWorld);
        if (outwards.dot(camera.position.clone().sub(point)) <= 0) return;
        point.project(camera);
        const off = Math.hypot(((point.x + 1) / 2) * area.width - x, ((1 - point.y) / 2) * area.height - y);
        if (off > least) return;
        least = off;
        told = found(place);
      });
    }
    return told;
  }
  function ofOne(object, name) {
    let found;
    for (let each = object; each; each = each.parent) {
      if (!each.visible) return undefined;
      found ??= each.userData[name];
    }
    return found;
  }
  function listen(keys, targets = () => scene.children) {
    const all = {
      ArrowLeft: () => turn(-0.15, 0), ArrowRight: () => turn(0.15, 0), ArrowUp: () => turn(0, -0.12), ArrowDown: () => turn(0, 0.12),
      "+": () => turn(0, 0, 0.85), "=": () => turn(0, 0, 0.85), "-": () => turn(0, 0, 1.18), "−": () => turn(0, 0, 1.18),
      0: () => (look(home), remember()), ...keys,
    };
    stage.addEventListener("keydown", (event) => {
      const act = event.ctrlKey || event.altKey || event.metaKey ? null : all[event.key];
      if (!act) return;
      event.preventDefault();
      act();
    });
    orbit.addEventListener("change", draw);
    orbit.addEventListener("end", () => remember());
    stage.addEventListener("pointerleave", () => (tip.hidden = true));
    let pressed = null;
    stage.addEventListener("pointerdown", (event) => (pressed = event));
    stage.addEventListener("click", (event) => {
      const turned = pressed && Math.hypot(event.clientX - pressed.clientX, event.clientY - pressed.clientY) > 5;
      pressed = null;
      if (turned) return; // the end of a drag is no click
      const { told } = under(event, "pick", targets); // a page that moves points listens
      if (told !== undefined) stage.dispatchEvent(new CustomEvent("twin:picked", { bubbles: true, detail: told }));
    });
    stage.addEventListener("pointermove", (event) => {
      const { told, area, x, y } = under(event, "label", targets);
      tip.hidden = told === undefined;
      if (tip.hidden) return;
      tip.textContent = told;
      tip.style.left = `${Math.min(x + 12, area.width - tip.offsetWidth - 4)}px`;
      tip.style.top = `${Math.min(y + 12, area.height - tip.offsetHeight - 4)}px`;
    });
    renderer.domElement.addEventListener("webglcontextlost", () => fail("The browser has taken the 3D view's memory away: reload the page."));
    new ResizeObserver(resize).observe(stage);
    resize();
  }
  // the view in the address: where it is looked at from, and what else a page keeps there
  function kept(recall, remembered) {
    const state = new URLSearchParams(location.hash.slice(1));
    const from = (state.get("from") || "").split(" ").map(Number);
    look(from.length === 6 && from.every(Number.isFinite) ? from : home);
    recall(state);
    remember = () => {
      const now = new URLSearchParams(remembered());
      now.set("from", [...camera.position.toArray(), ...orbit.target.toArray()].map((each) => each.toFixed(3)).join(" "));
      history.replaceState(null, "", `#${now}`);
    };
  }
  return {
    THREE, scene, stage, problems, report, fail, quaternion, vector, draw, listen, kept, parsed,
    remember: () => remember(),
    look,
    camera: () => [...camera.position.toArray(), ...orbit.target.toArray()],
    setHome: (numbers) => (home = numbers),
  };
};
