// The light as a mirror ball shows it: all of its directions but the one straight behind the ball.
import { make } from "./controls.js";
import { basis, rotationBlocks, turned } from "./harmonics.js";
import { axesOf } from "./vectors.js";

const SIZE = 80;

export class Ball {
  constructor(degree) {
    this.degree = degree;
    this.canvas = make("canvas", { width: SIZE, height: SIZE, className: "jaxsh-ball" });
    this.canvas.title = "The light in a mirror ball: drag it to turn the light";
    this.context = this.canvas.getContext("2d");
    this.image = this.context.createImageData(SIZE, SIZE);
    // In axes to the right, upwards and towards the eye, so that they stay when the camera moves.
    this.spots = [];
    const values = [];
    for (let i = 0; i < SIZE * SIZE; i++) {
      const x = (2 * (i % SIZE) + 1) / SIZE - 1;
      const y = 1 - (2 * Math.floor(i / SIZE) + 1) / SIZE;
      const squared = x * x + y * y;
      if (squared >= 1) continue;
      const z = Math.sqrt(1 - squared);
      values.push(basis([2 * z * x, 2 * z * y, 2 * z * z - 1], degree));
      // The outermost pixels are partly beside the ball.
      const cover = Math.min(1, ((1 - Math.sqrt(squared)) * SIZE) / 2);
      this.spots.push({ place: 4 * i, cover });
    }
    this.values = Float32Array.from(values.flatMap((some) => [...some]));
  }

  // Radiance negative by ringing is black.
  draw(light, camera, exposure) {
    const [right, up, forward] = axesOf(camera);
    const blocks = rotationBlocks([right, up, forward.map((x) => -x)], this.degree);
    const seen = light.map((channel) => Float32Array.from(turned(channel, blocks)));
    const { image: { data }, values } = this;
    const [red, green, blue] = seen;
    this.spots.forEach(({ place, cover }, spot) => {
      let [r, g, b] = [0, 0, 0];
      for (let k = 0, at = spot * red.length; k < red.length; k++, at++) {
        r += values[at] * red[k];
        g += values[at] * green[k];
        b += values[at] * blue[k];
      }
      [r, g, b].forEach((sum, c) => {
        data[place + c] = 255 * encoded(Math.max(0, Math.min(1, exposure * sum)));
      });
      data[place + 3] = 255 * cover;
    });
    this.context.putImageData(this.image, 0, 0);
  }
}

// sRGB's signal of linear light in [0, 1].
function encoded(linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055;
}
