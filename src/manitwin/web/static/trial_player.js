// Plays a grasp trial in the 3D view of a twin: hand and object as they were whenever the trial was looked at (trial_document.py),
// and smoothly between. Texts are only ever set as textContent.
"use strict";
globalThis.manitwinTrial = (viewer, view, object, hooks) => {
  const row = viewer.querySelector(".trial");
  if (!row) return null;
  const { THREE, scene, draw, report } = view;
  const field = (name) => row.querySelector(`[data-trial="${name}"]`);
  const kept = new Map(); // documents, by gripper and grasp
  let told = null; // the document that is open
  let hand = null;
  let now = 0; // seconds of the trial
  let playing = false;
  let before = 0; // of the last picture, in the browser's time
  let asked = 0; // the last request: an answer to an earlier one is dropped
  let from = null; // where the camera was

  const end = () => told.time_s[told.time_s.length - 1];
  function poseAt(numbers, at, share) {
    const still = numbers.length === 7;
    const next = still ? 0 : Math.min(at + 1, numbers.length / 7 - 1);
    const here = still ? 0 : at;
    const position = view.vector(numbers, 7 * here).lerp(view.vector(numbers, 7 * next), share);
    const turned = (place) => view.quaternion(numbers.slice(7 * place + 3, 7 * place + 7));
    return [position, turned(here).slerp(turned(next), share)];
  }
  function place(target, [position, turned]) {
    target.position.copy(position);
    target.quaternion.copy(turned);
  }
  function show() {
    const times = told.time_s;
    let at = 0;
    while (at + 1 < times.length && times[at + 1] <= now) at += 1;
    const share = at + 1 < times.length ? (now - times[at]) / (times[at + 1] - times[at]) : 0;
    place(object, poseAt(told.object, at, Math.max(0, share)));
    place(hand, poseAt(told.hand, at, Math.max(0, share)));
    told.boxes.forEach((box, number) => place(hand.children[number], poseAt(box.poses, at, Math.max(0, share))));
    const phase = told.phases.filter((each) => each.first <= at).pop();
    const over = now >= end();
    field("said").textContent = `${now.toFixed(2)} s, ${over ? `${phase.label}: ${told.outcome}` : phase.label}`;
    field("time").value = now;
    field("play").firstChild.textContent = playing ? "Pause " : "Play trial ";
    draw();
  }
  function tick(time) {
    if (!playing || !told) return;
    now = Math.min(end(), now + ((time - before) / 1000) * Number(field("speed").value));
    before = time;
    if (now >= end()) playing = false;
    show();
    if (playing) requestAnimationFrame(tick);
    else hooks.remember();
  }
  function run(on) {
    playing = on;
    if (on && now >= end()) now = 0;
    before = performance.now();
    show();
    if (on) requestAnimationFrame(tick);
    else hooks.remember();
  }
  function build(color) {
    const group = new THREE.Group();
    const material = new THREE.MeshStandardMaterial({ color, roughness: 0.7, transparent: true, opacity: 0.75 });
    for (const { half } of told.boxes) group.add(new THREE.Mesh(new THREE.BoxGeometry(...half.map((each) => 2 * each)), material));
    group.userData.label = () => `${told.gripper}, ${told.grasp_id}: ${told.outcome}`;
    scene.add(group);
    return group;
  }
  function drop() {
    if (!hand) return;
    scene.remove(hand);
    hand.children.forEach((each) => each.geometry.dispose());
    hand = null;
  }
  async function open(grasp, at = null) {
    asked += 1;
    const request = asked;
    field("said").textContent = "trying the grasp …";
    try {
      const key = `${grasp.gripper} ${grasp.id}`;
      const given = kept.get(key) || (await hooks.document(grasp));
      kept.set(key, given);
      if (request !== asked) return;
      told = given;
    } catch (error) {
      if (request !== asked) return;
      close();
      report(`The trial cannot be played: ${error.message}`, true);
      return;
    }
    drop();
    hand = build(hooks.color(told.outcome));
    if (!from) {
      from = view.camera();
      view.look(hooks.frame(told));
    }
    field("time").max = end();
    field("time").disabled = field("speed").disabled = field("close").disabled = false;
    hooks.opened(true);
    now = at === null ? 0 : Math.max(0, Math.min(end(), at));
    const unlike = told.outcome === told.recorded_outcome ? "" : ` (${told.recorded_outcome} when the twin was made: it is on the edge)`;
    report(`${told.grasp_id} by ${told.engine}: ${told.outcome}${unlike}`);
    run(at === null);
  }
  function close() {
    asked += 1;
    field("said").textContent = "";
    if (!told) return;
    told = null;
    playing = false;
    drop();
    field("time").disabled = field("speed").disabled = field("close").disabled = true;
    field("play").firstChild.textContent = "Play trial ";
    if (from) view.look(from);
    from = null;
    hooks.opened(false);
    hooks.remember();
  }
  function toggle() {
    const grasp = hooks.chosen();
    if (!grasp) return;
    if (told && told.grasp_id === grasp.id && told.gripper === grasp.gripper) run(!playing);
    else open(grasp);
  }
  field("play").addEventListener("click", toggle);
  field("close").addEventListener("click", close);
  field("time").addEventListener("input", () => {
    now = Number(field("time").value);
    playing = false;
    show();
    hooks.remember();
  });
  return { toggle, open, close, isOpen: () => Boolean(told), time: () => (told ? now : null) };
};
