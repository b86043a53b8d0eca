// What stands over the picture: the mirror balls, the color bar, what is known of a vertex, short words.
import { Ball } from "./ball.js";
import { barHeight, barWidth, drawBar, shortNumber } from "./color_bar.js";
import { make } from "./controls.js";

export class Overlay {
  constructor(viewer) {
    this.viewer = viewer;
    this.balls = [0, 1].map(() => new Ball(viewer.scene.degree));
    this.letters = ["A", "B"].map((letter) => make("b", { className: "jaxsh-letter" }, letter));
    this.bar = make("canvas", { className: "jaxsh-bar" });
    this.card = make("div", { className: "jaxsh-card" });
    this.said = make("p", { className: "jaxsh-toast", hidden: true });
    this.said.setAttribute("role", "status");
    this.elements = [
      ...this.balls.map((ball) => ball.canvas), ...this.letters, this.bar, this.card, this.said,
    ];
  }

  // Called after each drawing of the mesh.
  show() {
    const { viewer } = this;
    const { camera, exposure, compare, vertex } = viewer.state;
    [0, 1].forEach((side) => {
      const shown = side === 0 || compare;
      const { canvas } = this.balls[side];
      canvas.hidden = !shown;
      this.letters[side].hidden = !compare;
      if (!shown) return;
      const [left, top] = viewer.rectangle(side);
      for (const { style } of [canvas, this.letters[side]]) style.translate = `${left}px ${top}px`;
      this.balls[side].draw(viewer.light(side), camera, exposure * viewer.scene.exposure);
    });
    this.#showBar();
    this.#showCard(vertex);
  }

  say(text) {
    clearTimeout(this.timer);
    this.said.textContent = text;
    this.said.hidden = false;
    this.timer = setTimeout(() => (this.said.hidden = true), 2500);
  }

  #showBar() {
    const facts = this.viewer.barFacts();
    this.bar.hidden = !facts;
    if (!facts) return;
    const ratio = globalThis.devicePixelRatio || 1;
    const [width, height] = [barWidth(facts), barHeight(facts)];
    Object.assign(this.bar, { width: width * ratio, height: height * ratio });
    Object.assign(this.bar.style, { width: `${width}px`, height: `${height}px` });
    this.bar.setAttribute("role", "img");
    const range = facts.labels ? facts.labels.join(", ")
      : `from ${shortNumber(facts.low)} to ${shortNumber(facts.high)}`;
    this.bar.setAttribute("aria-label", `Color bar: ${facts.title}, ${range}`);
    const context = this.bar.getContext("2d");
    context.scale(ratio, ratio);
    const style = getComputedStyle(this.bar);
    drawBar(context, facts, style.color, style.backgroundColor);
  }

  #showCard(vertex) {
    this.card.hidden = vertex === null;
    if (vertex === null) return;
    const { viewer } = this;
    const { texels, tinted } = viewer.scene.surface;
    const at = [0, 1, 2].map((i) => shortNumber(viewer.scene.positions[3 * vertex + i]));
    const sent = Array.from(viewer.radianceOf(vertex), shortNumber);
    const close = make("button", { type: "button", title: "Close (Escape)" }, "×");
    close.setAttribute("aria-label", "Close");
    close.addEventListener("click", () => viewer.set({ vertex: null }));
    const line = (label, ...text) => make("p", {}, make("span", {}, label), ...text);
    const signs = ["positive", "negative"].map((sign) =>
      make("span", { className: `jaxsh-${sign}` }, sign));
    this.card.replaceChildren(
      close,
      make("b", {}, `${texels ? "Texel" : "Vertex"} ${vertex}`),
      line("at ", at.join(", ")),
      line(tinted ? "sends out, if white " : "sends out ", sent.join(", ")),
      ...viewer.scene.values.map((facts) => line(`${facts.name} `, viewer.valueOf(facts, vertex))),
      line("transfer: ", signs[0], ", ", signs[1]),
    );
  }
}
