// A mesh under a light that can be turned, dimmed and cut: its state, and what is drawn of it.
import { barHeight, drawBar, shortNumber } from "./color_bar.js";
import { make } from "./controls.js";
import { FalseColor } from "./false_color.js";
import { pictureOf } from "./gl.js";
import { rotationBlocks, turned } from "./harmonics.js";
import { Lobe } from "./lobe.js";
import { Overlay } from "./overlay.js";
import { makePanel } from "./panel.js";
import { PARTS } from "./parts.js";
import { pointUnder, rayAt } from "./picking.js";
import { listenToDrags, listenToKeys, listenToWheel } from "./pointer.js";
import { copied, pythonText } from "./python_text.js";
import { Renderer } from "./renderer.js";
import { saveImage } from "./save.js";
import { decoded } from "./scene.js";
import { sideRectangles } from "./sides.js";
import { UNTURNED, View } from "./view.js";

export class Viewer {
  // Builds picture and panel in `root`. `scene` is what `unpacked` gives.
  constructor(root, scene) {
    this.root = root;
    this.scene = scene;
    this.lights = scene.lights;
    this.reset();
    this.canvas = make("canvas", { tabIndex: 0 });
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${scene.title}: arrows orbit, with Shift they turn the light`);
    root.classList.add("jaxsh");
    this.overlay = new Overlay(this);
    this.stage = make("div", { className: "jaxsh-stage" }, this.canvas, ...this.overlay.elements);
    this.panel = makePanel(this);
    root.replaceChildren(make("div", { className: "jaxsh-body" }, this.stage, this.panel.element));
    root.viewer = this;
    this.#listen();
    this.#build();
  }

  // In common are the camera, exposure (a factor on that of the scene), rotation (of the light), whether
  // two sides are compared, the look (0 color, 1 luminance, 2 and on the values), how opaque that is
  // over the colors, and the vertex whose transfer is shown. Others are facts of a side's light.
  reset() {
    const { camera, degree } = this.scene;
    const parts = PARTS.map((part) => part.start?.(this.scene) ?? {});
    const light = Object.assign({ degree, index: 0, intensity: 1 }, ...parts);
    const shared = { camera, exposure: 1, rotation: UNTURNED, compare: false };
    this.shared = { ...shared, look: 0, over: 1, vertex: null };
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
      shades ||= name === "camera" && PARTS.some((part) => part.seesCamera?.(this.scene));
      if (ofLight) this.sides[this.side] = { ...this.sides[this.side], [name]: value };
      else this.shared = { ...this.shared, [name]: value };
    }
    this.panel.show(this.state);
    this.#draw(shades);
  }

  // Chooses a look; levels let the picture shine through.
  chooseLook(look) {
    this.set({ look, over: this.scene.values[look - 2]?.labels ? 0.7 : 1 });
  }

  // Chooses the side that the panel changes.
  choose(side) {
    this.side = side;
    this.set({});
  }

  // In place of those that were given at first; sky and lamp stay.
  setLights(lights) {
    this.lights = [...lights, ...this.scene.lights.slice(lights.length)];
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

  // Draws now, after shading where what shades has changed.
  draw() {
    if (this.shades) this.#shown().forEach((side) => this.#shade(side));
    this.shades = false;
    this.#paint(this.canvas.width, this.canvas.height);
    this.overlay.show();
  }

  // What the present camera sees, as RGBA in 8 bits, of any size.
  pixels(width, height, samples = 1) {
    this.#shown().forEach((side) => this.#shade(side));
    return pictureOf(this.renderer.gl, width, height, samples, () => this.#paint(width, height));
  }

  // Left, top, width and height of a side on the canvas, in pixels of the page.
  rectangle(side = this.side) {
    const { clientWidth, clientHeight } = this.canvas;
    const [left, bottom, width, height] = this.#rectangles(clientWidth, clientHeight)[side];
    return [left, clientHeight - bottom - height, width, height];
  }

  extent() {
    return this.rectangle(0).slice(2);
  }

  // What the colors stand for, for `drawBar`; null where they are the picture's own.
  barFacts() {
    const { look, exposure } = this.shared;
    if (look === 0) return null;
    const high = 1 / (exposure * this.scene.exposure);
    if (look === 1) return { title: "Luminance, in the light's unit", low: 0, high, under: true, over: true };
    const { name: title, labels, low, high: most } = this.scene.values[look - 2];
    return { title, labels, low, high: most };
  }

  // One of the scene's values at a vertex, in words.
  valueOf({ array, labels, low, high }, vertex) {
    const code = this.scene[array][vertex];
    return labels ? labels[code] : shortNumber(decoded(code, low, high));
  }

  // Linear radiance of one vertex as it was last shaded.
  radianceOf(vertex) {
    return this.renderer.colors(this.side, vertex, 1);
  }

  // A PNG that is transparent beside the mesh; in false color with the bar.
  save() {
    const { width, height } = this.canvas;
    const facts = this.barFacts();
    const scale = width / this.canvas.clientWidth;
    saveImage(this.pixels(width, height, 4), width, height, (context) => {
      if (!facts) return;
      context.scale(scale, scale);
      context.translate(12, height / scale - barHeight(facts) - 12);
      drawBar(context, facts, "black", "rgb(255 255 255 / 0.85)");
    });
    this.#draw(false); // a browser empties the canvas once anything is drawn, elsewhere too
  }

  // Python of the view.
  python() {
    const { width, height } = this.canvas;
    const [, , ...size] = this.#rectangles(width, height)[0];
    const { scene, state } = this;
    // Sky and lamp are turned otherwise.
    const rotation = scene.kinds[state.index] === "given" ? state.rotation : UNTURNED;
    const own = PARTS.flatMap((part) => part.python?.(state, scene) ?? []);
    const text = pythonText({ ...state, rotation }, state.exposure * scene.exposure, ...size);
    return text + own.map((line) => `${line}\n`).join("");
  }

  async copy() {
    const done = await copied(this.python());
    this.overlay.say(done ? "Copied as Python" : "This browser does not let the page copy");
  }

  // Shows the transfer of the vertex under a place of the page, or that in the middle.
  pick(x, y) {
    const [left, top, width, height] = this.#sideAt(x, y);
    const place = [(2 * (x - left)) / width - 1, 1 - (2 * (y - top)) / height];
    const ray = rayAt(this.shared.camera, x === undefined ? [0, 0] : place, width / height);
    const vertex = pointUnder(this.scene, ray);
    if (vertex === null && x === undefined) this.overlay.say("Nothing in the middle");
    this.set({ vertex });
  }

  #sideAt(x, y) {
    const holds = ([left, top, width, height]) =>
      x >= left && x < left + width && y >= top && y < top + height;
    return this.#shown().map((side) => this.rectangle(side)).find(holds) ?? this.rectangle(0);
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

  #rectangles(width, height) {
    return sideRectangles(width, height, this.shared.compare);
  }

  #build() {
    try {
      this.renderer = new Renderer(this.canvas, this.scene);
    } catch (error) {
      this.renderer = null;
      this.stage.append(make("p", { className: "jaxsh-error", role: "alert" }, error.message));
      return;
    }
    [this.falseColor, this.lobe] = [null, null]; // made when first shown
    this.#draw(true);
  }

  #draw(shades) {
    this.shades ||= shades;
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      if (this.renderer && !this.released) this.draw();
    });
  }

  #shade(side) {
    const [light, state] = [this.light(side), this.stateOf(side)];
    const { renderer, scene } = this;
    const shaded = PARTS.some((part) => part.shade?.(renderer, light, state, side, scene));
    if (!shaded) renderer.shade(light, side);
  }

  #paint(width, height) {
    const { renderer } = this;
    const { camera, exposure, look, over, vertex } = this.shared;
    let used;
    if (look > 0) {
      this.falseColor ??= new FalseColor(renderer);
      used = this.falseColor.use(look - 2, over);
    }
    renderer.clear(width, height);
    this.#rectangles(width, height).forEach((rectangle, side) => {
      renderer.draw(camera, exposure * this.scene.exposure, rectangle, side, used);
      if (vertex === null) return;
      this.lobe ??= new Lobe(renderer);
      this.lobe.draw(vertex, this.stateOf(side).degree, camera, rectangle);
    });
  }

  #listen() {
    const { canvas } = this;
    this.view = new View(this);
    const { view } = this;
    const which = (event) => (event.shiftKey || this.turns ? "light" : "camera");
    listenToDrags(canvas, view, which, ({ offsetX, offsetY }) => this.pick(offsetX, offsetY));
    this.overlay.balls.forEach((ball) => listenToDrags(ball.canvas, view, () => "light"));
    listenToWheel(canvas, view);
    const looks = this.scene.values.length + 2;
    listenToKeys(canvas, view, which, {
      Enter: () => this.pick(),
      Escape: () => this.set({ vertex: null }),
      c: () => this.set({ compare: !this.shared.compare }),
      f: () => this.chooseLook((this.shared.look + 1) % looks),
      p: () => this.copy(),
      r: () => this.reset(),
      s: () => this.save(),
    });
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
