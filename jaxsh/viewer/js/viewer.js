// A mesh under a light that can be turned, dimmed and cut: state, pointer, keyboard, panel.
import { Ball } from "./ball.js";
import { button, menu, panel, slider, toggle } from "./controls.js";
import { rotationBlocks, turned } from "./harmonics.js";
import { Renderer } from "./renderer.js";
import { about, axesOf, minus, multiply, orbited, plus } from "./vectors.js";

const UNTURNED = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const HINT = "Drag to orbit; drag the mirror ball, or with Shift, to turn the light; wheel or pinch to "
  + "come near. "
  + "With the keyboard: arrows, Shift and arrows, + and −.";
const STEP = Math.PI / 36;

export class Viewer {
  // Builds picture and panel in `root`. `scene` is what `unpacked` gives.
  constructor(root, scene) {
    this.root = root;
    this.scene = scene;
    this.lights = scene.lights;
    this.state = this.#start();
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${scene.title}. ${HINT}`);
    root.classList.add("jaxsh");
    this.ball = new Ball(scene.degree);
    root.replaceChildren(this.canvas, this.ball.canvas, this.#panel());
    root.viewer = this;
    this.#listen();
    this.#build();
  }

  #start() {
    const { camera, degree } = this.scene;
    return { camera, degree, index: 0, intensity: 1, exposure: 1, rotation: UNTURNED };
  }

  // Changes some of camera, degree, index (of the light), intensity, exposure (a factor on that of
  // the scene) and rotation (of the light), and draws when the browser next does.
  set(some) {
    const shades = ["degree", "index", "intensity", "rotation"].some((name) => name in some);
    this.state = { ...this.state, ...some };
    this.#show();
    this.#draw(shades);
  }

  setLights(lights) {
    this.lights = lights;
    this.#draw(true);
  }

  // The light that shades: three arrays of K coefficients.
  light() {
    const { degree, index, intensity, rotation } = this.state;
    const blocks = rotationBlocks(rotation, this.scene.degree);
    const kept = (degree + 1) ** 2;
    return this.lights[index].map((channel) =>
      turned(channel, blocks).map((x, k) => (k < kept ? intensity * x : 0)),
    );
  }

  // Linear radiance of the vertices under the present light, three numbers each.
  colors() {
    this.renderer.shade(this.light());
    return this.renderer.colors();
  }

  // What the present camera sees, as RGBA in 8 bits, of any size.
  pixels(width, height) {
    this.renderer.shade(this.light());
    const { camera, exposure } = this.state;
    return this.renderer.pixels(camera, exposure * this.scene.exposure, width, height);
  }

  release() {
    this.released = true;
    this.observer.disconnect();
    this.renderer?.release();
  }

  #build() {
    try {
      this.renderer = new Renderer(this.canvas, this.scene);
    } catch (error) {
      this.renderer = null;
      this.root.append(Object.assign(document.createElement("p"), {
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
      const light = this.light();
      if (this.shades) this.renderer.shade(light);
      this.shades = false;
      const { width, height } = this.canvas;
      const { camera } = this.state;
      const exposure = this.state.exposure * this.scene.exposure;
      this.renderer.draw(camera, exposure, width, height);
      this.ball.draw(light, camera, exposure);
    });
  }

  #panel() {
    const stops = (x) => `${x < 0 ? "−" : "+"}${Math.abs(x).toFixed(1)} stops`;
    const controls = {
      exposure: slider("Exposure", {
        min: -5, max: 5, step: 0.1, value: 0, said: stops,
        changed: (x) => this.set({ exposure: 2 ** x }),
      }),
      intensity: slider("Intensity of the light", {
        min: 0, max: 4, step: 0.05, value: 1, said: (x) => `× ${x.toFixed(2)}`,
        changed: (intensity) => this.set({ intensity }),
      }),
      degree: slider("Degree of the light", {
        min: 0, max: this.scene.degree, step: 1, value: this.scene.degree, said: String,
        changed: (degree) => this.set({ degree }),
      }),
    };
    if (this.lights.length > 1) {
      controls.index = menu("Light", this.scene.names, (index) => this.set({ index }));
    }
    this.turning = toggle("Drag turns the light", (on) => (this.turns = on));
    this.controls = controls;
    const buttons = [
      this.turning,
      button("Reset", () => this.set(this.#start())),
      button("Save PNG", () => this.#save()),
    ];
    const order = ["index", "exposure", "intensity", "degree"].filter((name) => controls[name]);
    return panel(this.scene.title, order.map((name) => controls[name]), buttons, HINT);
  }

  #show() {
    const { degree, index, intensity, exposure } = this.state;
    this.controls.exposure.set(Math.log2(exposure));
    this.controls.intensity.set(intensity);
    this.controls.degree.set(degree);
    this.controls.index?.set(index);
  }

  #save() {
    const { width, height } = this.canvas;
    const picture = Object.assign(document.createElement("canvas"), { width, height });
    const pixels = new ImageData(this.pixels(width, height), width, height);
    picture.getContext("2d").putImageData(pixels, 0, 0);
    const link = document.createElement("a");
    link.download = "jaxsh.png";
    link.href = picture.toDataURL("image/png");
    link.click();
  }

  // Angles in radians: the light or the camera, as if the mesh were taken hold of.
  #turn(across, over, light) {
    const { camera, rotation } = this.state;
    if (!light) return this.set({ camera: orbited(camera, across, over) });
    const [right] = axesOf(camera);
    const turn = multiply(about(camera.up, across), about(right, over));
    return this.set({ rotation: multiply(turn, rotation) });
  }

  #zoom(factor) {
    const { camera } = this.state;
    const away = minus(camera.position, camera.target);
    const distance = Math.hypot(...away) * factor;
    if (distance < this.scene.radius / 50 || distance > this.scene.radius * 100) return;
    this.set({ camera: { ...camera, position: plus(camera.target, away, factor) } });
  }

  #listen() {
    const { canvas } = this;
    this.#listenToDrags(canvas, (event) => event.shiftKey || this.turns);
    this.#listenToDrags(this.ball.canvas, () => true);
    const near = (event) => {
      event.preventDefault();
      this.#zoom(Math.exp(Math.max(-0.3, Math.min(0.3, event.deltaY / 500))));
    };
    canvas.addEventListener("wheel", near, { passive: false });
    canvas.addEventListener("keydown", (event) => this.#key(event));
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

  // A drag turns the light where `light` says so of an event, and otherwise orbits.
  #listenToDrags(element, light) {
    const held = new Map();
    const spread = () => {
      const [a, b] = [...held.values()];
      return Math.hypot(a[0] - b[0], a[1] - b[1]);
    };
    element.addEventListener("pointerdown", (event) => {
      held.set(event.pointerId, [event.clientX, event.clientY]);
      element.setPointerCapture(event.pointerId);
    });
    element.addEventListener("pointermove", (event) => {
      const last = held.get(event.pointerId);
      if (!last) return;
      const before = held.size === 2 ? spread() : 0;
      held.set(event.pointerId, [event.clientX, event.clientY]);
      if (held.size === 2) return void this.#zoom(before / Math.max(spread(), 1));
      const { clientWidth, clientHeight } = this.canvas;
      const scale = Math.PI / Math.min(clientWidth, clientHeight);
      const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
      this.#turn(dx * scale, dy * scale, light(event));
    });
    for (const name of ["pointerup", "pointercancel"]) {
      element.addEventListener(name, (event) => held.delete(event.pointerId));
    }
  }

  #key(event) {
    const arrows = {
      ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, -STEP], ArrowDown: [0, STEP],
    };
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key in arrows) this.#turn(...arrows[event.key], event.shiftKey || this.turns);
    else if (event.key === "+" || event.key === "=") this.#zoom(1 / 1.1);
    else if (event.key === "-") this.#zoom(1.1);
    else return;
    event.preventDefault();
  }
}
