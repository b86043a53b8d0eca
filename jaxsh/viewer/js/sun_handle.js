// The sun on the mirror ball: a ring around its reflection, which is dragged.
import { Handle } from "./handle.js";
import { bearingOf, heightOf, keptUp, sunFrom } from "./sky.js";
import { axesOf, dot } from "./vectors.js";

const SUN_STEPS = { ArrowLeft: [0, -3], ArrowRight: [0, 3], ArrowUp: [3, 0], ArrowDown: [-3, 0] };
const SUN_HINT = "Drag the sun on the mirror ball, or set it here.";

export class SunHandle extends Handle {
  constructor(viewer) {
    const properties = { className: "jaxsh-sun", title: "The sun: drag it" };
    super(viewer, "sky", SUN_HINT, properties, "Sun: arrows move it around the horizon, up and down");
    this.#listen();
  }

  // Center and radius of the ball of the side that the panel changes.
  #ball() {
    const { overlay, side } = this.viewer;
    const { canvas } = overlay.balls[side];
    const [left, top] = this.viewer.rectangle();
    const radius = canvas.offsetWidth / 2;
    return [left + canvas.offsetLeft + radius, top + canvas.offsetTop + radius, radius];
  }

  // The ball's normal is halfway between the eye, which is far away, and the sun.
  place() {
    const { camera, sun } = this.viewer.state;
    const [x, y, away] = axesOf(camera).map((axis) => dot(axis, sun));
    const length = Math.hypot(x, y, 1 - away);
    const [across, up] = length > 1e-6 ? [x / length, y / length] : [0, 1];
    const [centerX, centerY, radius] = this.#ball();
    const size = this.button.offsetWidth;
    const place = [centerX + radius * across - size / 2, centerY - radius * up - size / 2];
    this.button.style.translate = place.map((pixels) => `${pixels}px`).join(" ");
    this.button.classList.toggle("jaxsh-away", sun[2] < 0);
  }

  // Puts the sun where a place of the page mirrors it.
  #put(event) {
    const bounds = this.viewer.stage.getBoundingClientRect();
    const [centerX, centerY, radius] = this.#ball();
    let x = (event.clientX - bounds.left - centerX) / radius;
    let y = (centerY - (event.clientY - bounds.top)) / radius;
    const out = Math.hypot(x, y) / 0.99;
    if (out > 1) [x, y] = [x / out, y / out];
    const z = Math.sqrt(1 - x * x - y * y);
    const [right, up, forward] = axesOf(this.viewer.state.camera);
    const sun = right.map((_, i) =>
      2 * z * (x * right[i] + y * up[i]) - (2 * z * z - 1) * forward[i]);
    this.viewer.set({ sun: keptUp(sun) });
  }

  #listen() {
    const { button } = this;
    button.addEventListener("pointerdown", (event) => button.setPointerCapture(event.pointerId));
    button.addEventListener("pointermove", (event) => {
      if (button.hasPointerCapture(event.pointerId)) this.#put(event);
    });
    button.addEventListener("keydown", (event) => {
      if (!(event.key in SUN_STEPS)) return;
      const { sun } = this.viewer.state;
      const [over, around] = SUN_STEPS[event.key];
      const up = Math.max(0, Math.min(89.9, heightOf(sun) + over));
      this.viewer.set({ sun: sunFrom(up, bearingOf(sun) + around) });
      event.preventDefault();
      event.stopPropagation();
    });
  }
}
