// What is dragged over the picture: a button, with a hint in the panel.
import { make } from "./controls.js";

export class Handle {
  // Seen while the light is of a `kind`. A class that extends this has `place()`, which puts the button
  // where it belongs in the picture.
  constructor(viewer, kind, hint, properties, label) {
    this.viewer = viewer;
    this.kind = kind;
    this.element = make("p", { className: "jaxsh-said" }, hint);
    this.button = make("button", { type: "button", ...properties });
    this.button.setAttribute("aria-label", label);
  }

  // Called whenever the state has changed.
  show(state) {
    const { canvas, scene, stage } = this.viewer;
    const hidden = scene.kinds[state.index] !== this.kind;
    this.element.hidden = this.button.hidden = hidden;
    if (hidden) return;
    if (!this.observer) {
      stage.append(this.button);
      this.observer = new ResizeObserver(() => this.button.hidden || this.place());
      this.observer.observe(canvas);
    }
    this.place();
  }
}
