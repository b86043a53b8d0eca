// The lamp over the picture: a disc as large as the lamp is seen, which is dragged.
import { Handle } from "./handle.js";
import { keptNear } from "./near.js";
import { axesOf, dot, minus, plus, tangentOf } from "./vectors.js";

const LARGEST_LAMP = 120;
const SMALLEST_LAMP = 24; // pixels: what a finger can take hold of
const LAMP_STEPS = { ArrowLeft: [-10, 0], ArrowRight: [10, 0], ArrowUp: [0, -10], ArrowDown: [0, 10] };
const LAMP_HINT = "Drag the lamp; the wheel over it, or Page Up and Page Down, move it along the view.";

export class LampHandle extends Handle {
  constructor(viewer) {
    const properties = { className: "jaxsh-lamp", title: "The lamp: drag it" };
    super(viewer, "lamp", LAMP_HINT, properties, `Lamp. ${LAMP_HINT} Arrows move it.`);
    this.#listen();
  }

  // Where the camera sees the lamp, in pixels of the page, and how large a pixel is there.
  #seen() {
    const { camera, lamp } = this.viewer.state;
    const [left, top, width, height] = this.viewer.rectangle();
    const tangent = tangentOf(camera, width / height);
    const axes = axesOf(camera);
    const [x, y, depth] = axes.map((axis) => dot(axis, minus(lamp, camera.position)));
    const pixel = (2 * Math.abs(depth) * tangent) / height;
    const at = [left + width / 2 + x / pixel, top + height / 2 - y / pixel];
    return { axes, at, pixel, behind: depth <= 0, ends: [left, top, left + width, top + height] };
  }

  // Stays within the picture, so that it can be taken hold of from everywhere.
  place() {
    const { at, pixel, behind, ends } = this.#seen();
    const { radius, radiance } = this.viewer.scene.near;
    const size = Math.max(SMALLEST_LAMP, Math.min(LARGEST_LAMP, (2 * (radius ?? 0)) / pixel));
    const within = at.map((x, axis) => Math.max(ends[axis], Math.min(ends[axis + 2], x)));
    const outside = behind || within.some((x, axis) => x !== at[axis]);
    const { style } = this.button;
    style.width = style.height = `${size}px`;
    style.translate = `${within[0] - size / 2}px ${within[1] - size / 2}px`;
    this.button.classList.toggle("jaxsh-away", outside);
    const most = Math.max(...(radiance ?? [1]));
    const color = (radiance ?? [1, 1, 1]).map((x) => 255 * (most > 0 ? x / most : 1) ** (1 / 2.2));
    style.setProperty("--color", `rgb(${color.map(Math.round).join(" ")})`);
  }

  #move(lamp) {
    this.viewer.set({ lamp: keptNear(this.viewer.scene.near, lamp) });
  }

  // By pixels, in the plane through the lamp that faces the camera.
  #drag(dx, dy) {
    const { axes: [right, up], pixel } = this.#seen();
    this.#move(plus(plus(this.viewer.state.lamp, right, dx * pixel), up, -dy * pixel));
  }

  // Along the view: farther for factors above 1.
  #push(factor) {
    const { camera, lamp } = this.viewer.state;
    this.#move(plus(camera.position, minus(lamp, camera.position), factor));
  }

  #listen() {
    const { button } = this;
    let last;
    button.addEventListener("pointerdown", (event) => {
      last = [event.clientX, event.clientY];
      button.setPointerCapture(event.pointerId);
    });
    button.addEventListener("pointermove", (event) => {
      if (!last || !button.hasPointerCapture(event.pointerId)) return;
      this.#drag(event.clientX - last[0], event.clientY - last[1]);
      last = [event.clientX, event.clientY];
    });
    const push = (event) => {
      event.preventDefault();
      this.#push(Math.exp(Math.max(-0.1, Math.min(0.1, event.deltaY / 1000))));
    };
    button.addEventListener("wheel", push, { passive: false });
    button.addEventListener("keydown", (event) => {
      if (event.key in LAMP_STEPS) this.#drag(...LAMP_STEPS[event.key]);
      else if (event.key === "PageUp") this.#push(1.05);
      else if (event.key === "PageDown") this.#push(1 / 1.05);
      else return;
      event.preventDefault();
      event.stopPropagation();
    });
  }
}
