// Mouse, touch and keyboard: what they do to a view that can `turn`, `move` and `zoom`.

const STEP = Math.PI / 36;
const CLICK = 4; // pixels that a pointer may move in a click

// Drags on `element` turn what `which(event)` names, "camera" or "light"; with the right button, or
// with two fingers, they move the camera's target. A press that does not drag is a click.
export function listenToDrags(element, view, which, clicked = () => {}) {
  const held = new Map();
  let path = 0;
  const middle = () => [0, 1].map((i) => [...held.values()].reduce((s, at) => s + at[i], 0) / held.size);
  const spread = () => {
    const [a, b] = [...held.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  };
  element.addEventListener("pointerdown", (event) => {
    if (held.size === 0) path = 0;
    held.set(event.pointerId, [event.clientX, event.clientY]);
    element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointermove", (event) => {
    const last = held.get(event.pointerId);
    if (!last) return;
    const [apart, from] = [held.size === 2 ? spread() : 0, middle()];
    held.set(event.pointerId, [event.clientX, event.clientY]);
    path += Math.hypot(event.clientX - last[0], event.clientY - last[1]);
    const to = middle();
    const drag = [to[0] - from[0], to[1] - from[1]];
    if (held.size === 2) view.zoom(apart / Math.max(spread(), 1));
    if (held.size === 2 || event.buttons & 2) view.move(...drag);
    else view.turn(...drag, which(event));
  });
  element.addEventListener("pointerup", (event) => {
    const alone = held.delete(event.pointerId) && held.size === 0;
    if (alone && path < CLICK && event.button === 0) clicked(event);
  });
  element.addEventListener("pointercancel", (event) => {
    held.delete(event.pointerId);
    path = Infinity;
  });
  element.addEventListener("contextmenu", (event) => event.preventDefault());
}

export function listenToWheel(element, view) {
  const near = (event) => {
    event.preventDefault();
    view.zoom(Math.exp(Math.max(-0.3, Math.min(0.3, event.deltaY / 500))));
  };
  element.addEventListener("wheel", near, { passive: false });
}

// Arrows turn as a drag would, and further `keys` call what they name.
export function listenToKeys(element, view, which, keys) {
  const arrows = {
    ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, -STEP], ArrowDown: [0, STEP],
  };
  element.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key in arrows) view.turnBy(...arrows[event.key], which(event));
    else if (event.key === "+" || event.key === "=") view.zoom(1 / 1.1);
    else if (event.key === "-") view.zoom(1.1);
    else if (event.key in keys) keys[event.key]();
    else return;
    event.preventDefault();
    event.stopPropagation(); // a notebook has keys of its own
  });
}
