// A mesh under a light that can be turned, dimmed and cut: its state, and what is drawn of it.
import { Ball } from "./ball.js";
import { pictureOf } from "./gl.js";
import { rotationBlocks, turned } from "./harmonics.js";
import { makePanel } from "./panel.js";
import { PARTS } from "./parts.js";
import { listenToDrags, listenToKeys, listenToWheel } from "./pointer.js";
import { Renderer } from "./renderer.js";
import { saveImage } from "./save.js";
import { UNTURNED, View } from "./view.js";

const HINT = "Drag to orbit; drag the mirror ball, or with Shift, to turn the light; wheel or pinch to "
  + "come near; drag with the right button or two fingers to move. With the keyboard: arrows, Shift and "
  + "arrows, + and −.";

export class Viewer {
  // Builds picture and panel in `root`. `scene` is what `unpacked` gives.
  constructor(root, scene) {
    this.root = root;
    this.scene = scene;
    this.lights = scene.lights;
    this.reset();
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${scene.title}. ${HINT}`);
    root.classList.add("jaxsh");
    this.balls = [new Ball(scene.degree), new Ball(scene.degree)];
    this.stage = Object.assign(document.createElement("div"), { className: "jaxsh-stage" });
    this.stage.append(this.canvas, ...this.balls.map((ball) => ball.canvas));
    this.panel = makePanel(this, HINT);
    root.replaceChildren(this.stage, this.panel.element);
    root.viewer = this;
    this.#listen();
    this.#build();
  }

  // Camera, exposure (a factor on that of the scene), rotation (of the light) and whether two sides
  // are compared are in common; the other facts of a light are those of a side.
  reset() {
    const { camera, degree } = this.scene;
    const parts = PARTS.map((part) => part.start?.(this.scene) ?? {});
    const light = Object.assign({ degree, index: 0, intensity: 1 }, ...parts);
    this.shared = { camera, exposure: 1, rotation: UNTURNED, compare: false };
    this.sides = [light, light];
    this.side = 0; // the one that the panel shows and changes
    if (this.panel) this.set({});
  }

  // All facts, those of a light being of one side.
  stateOf(side) {
    return { ...this.shared, ...this.sides[side] };
  }

  get state() {
    return this.stateOf(this.side);
  }

  // Changes some facts and draws when the browser next does.
  set(some) {
    if (some.compare && !this.shared.compare) this.sides[1] = this.#other(this.sides[0]);
    if (some.compare === false) this.side = 0;
    let shades = Object.keys(some).length === 0;
    for (const [name, value] of Object.entries(some)) {
      const ofLight = name in this.sides[0];
      shades ||= ofLight || name === "rotation" || name === "compare";
      if (ofLight) this.sides[this.side] = { ...this.sides[this.side], [name]: value };
      else this.shared = { ...this.shared, [name]: value };
    }
    this.panel.show(this.state);
    this.#draw(shades);
  }

  // Chooses the side that the panel changes.
  choose(side) {
    this.side = side;
    this.set({});
  }

  setLights(lights) {
    this.lights = lights;
    this.#draw(true);
  }

  // The light that shades a side: three arrays of K coefficients.
  light(side = this.side) {
    const state = this.stateOf(side);
    const blocks = rotationBlocks(state.rotation, this.scene.degree);
    const kept = (state.degree + 1) ** 2;
    const cut = this.lights[state.index].map((channel) =>
      turned(channel, blocks).map((x, k) => (k < kept ? state.intensity * x : 0)),
    );
    const changed = (light, part) => part.light?.(light, state, this.scene) ?? light;
    return PARTS.reduce(changed, cut);
  }

  // Linear radiance of the vertices under the present light, three numbers each.
  colors(side = this.side) {
    this.#shade(side);
    return this.renderer.colors(side);
  }

  // What the present camera sees, as RGBA in 8 bits, of any size.
  pixels(width, height, samples = 1) {
    this.#shown().forEach((side) => this.#shade(side));
    return pictureOf(this.renderer.gl, width, height, samples, () => this.#paint(width, height));
  }

  // Width and height of one view, in pixels of the page.
  extent() {
    const { clientWidth, clientHeight } = this.canvas;
    return this.#rectangles(clientWidth, clientHeight)[0].slice(2);
  }

  save() {
    const { width, height } = this.canvas;
    saveImage(this.pixels(width, height, 4), width, height);
  }

  release() {
    this.released = true;
    this.observer.disconnect();
    this.renderer?.release();
  }

  // With two sides, where B first differs from A: the next light, or else a light of degree 2.
  #other(light) {
    const { length } = this.lights;
    if (length > 1) return { ...light, index: (light.index + 1) % length };
    return { ...light, degree: light.degree > 2 ? 2 : 0 };
  }

  #shown() {
    return this.shared.compare ? [0, 1] : [0];
  }

  // Left, bottom, width and height of each side: beside or, in a high window, above each other.
  #rectangles(width, height) {
    if (!this.shared.compare) return [[0, 0, width, height]];
    if (width < height) {
      const half = Math.floor(height / 2);
      return [[0, height - half, width, half], [0, 0, width, half]];
    }
    const half = Math.floor(width / 2);
    return [[0, 0, half, height], [width - half, 0, half, height]];
  }

  #build() {
    try {
      this.renderer = new Renderer(this.canvas, this.scene);
    } catch (error) {
      this.renderer = null;
      this.stage.append(Object.assign(document.createElement("p"), {
        className: "jaxsh-error",
        role: "alert",
        textContent: error.message,
      }));
      return;
    }
    this.#draw(true);
  }

  #draw(shades) {
    this.shades ||= shades;
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      if (!this.renderer || this.released) return;
      if (this.shades) this.#shown().forEach((side) => this.#shade(side));
      this.shades = false;
      this.#paint(this.canvas.width, this.canvas.height);
      this.#lay();
    });
  }

  #shade(side) {
    const [light, state] = [this.light(side), this.stateOf(side)];
    const { renderer, scene } = this;
    const shaded = PARTS.some((part) => part.shade?.(renderer, light, state, side, scene));
    if (!shaded) renderer.shade(light, side);
  }

  #paint(width, height) {
    const { camera, exposure } = this.shared;
    this.renderer.clear(width, height);
    this.#rectangles(width, height).forEach((rectangle, side) => {
      this.renderer.draw(camera, exposure * this.scene.exposure, rectangle, side);
    });
  }

  // What stands over the picture.
  #lay() {
    const { camera, exposure, compare } = this.shared;
    const { clientWidth, clientHeight } = this.canvas;
    this.stage.classList.toggle("jaxsh-two", compare);
    this.balls[1].canvas.hidden = !compare;
    this.#rectangles(clientWidth, clientHeight).forEach(([left, bottom, , height], side) => {
      const { canvas } = this.balls[side];
      canvas.style.translate = `${left}px ${clientHeight - bottom - height}px`;
      this.balls[side].draw(this.light(side), camera, exposure * this.scene.exposure);
    });
  }

  #listen() {
    const { canvas } = this;
    const view = new View(this);
    const which = (event) => (event.shiftKey || this.turns ? "light" : "camera");
    listenToDrags(canvas, view, which);
    this.balls.forEach((ball) => listenToDrags(ball.canvas, view, () => "light"));
    listenToWheel(canvas, view);
    listenToKeys(canvas, view, which, {});
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => !this.released && this.#build());
    this.observer = new ResizeObserver(() => {
      const ratio = globalThis.devicePixelRatio || 1;
      canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
      canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
      this.#draw(false);
    });
    this.observer.observe(canvas);
  }
}
