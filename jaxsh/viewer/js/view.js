// Changes of a camera and of the light's rotation, from distances on the screen.
import { PARTS } from "./parts.js";
import { about, axesOf, minus, multiply, orbited, plus, tangentOf } from "./vectors.js";

export const UNTURNED = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

export class View {
  // `viewer` has `state`, `set(some)`, `scene`, and `extent()`: width and height of one view, in
  // pixels of the page.
  constructor(viewer) {
    this.viewer = viewer;
  }

  // Pixels: the camera, or the light, as if the mesh were taken hold of.
  turn(dx, dy, which) {
    const scale = Math.PI / Math.min(...this.viewer.extent());
    this.turnBy(dx * scale, dy * scale, which);
  }

  // The same in radians.
  turnBy(across, over, which) {
    const { state, scene } = this.viewer;
    const { camera, rotation } = state;
    if (which === "camera") return this.viewer.set({ camera: orbited(camera, across, over) });
    const [right] = axesOf(camera);
    const turn = multiply(about(camera.up, across), about(right, over));
    const other = PARTS.map((part) => part.turn?.(turn, state, scene)).find((some) => some);
    return this.viewer.set(other ?? { rotation: multiply(turn, rotation) });
  }

  // Pixels: the camera beside its target and both alike.
  move(dx, dy) {
    const { camera } = this.viewer.state;
    const [width, height] = this.viewer.extent();
    const distance = Math.hypot(...minus(camera.position, camera.target));
    const scale = (2 * distance * tangentOf(camera, width / height)) / height;
    const [right, up] = axesOf(camera);
    const moved = (point) => plus(plus(point, right, -dx * scale), up, dy * scale);
    const [position, target] = [moved(camera.position), moved(camera.target)];
    this.viewer.set({ camera: { ...camera, position, target } });
  }

  zoom(factor) {
    const { state: { camera }, scene: { radius } } = this.viewer;
    const away = minus(camera.position, camera.target);
    const distance = Math.hypot(...away) * factor;
    if (distance < radius / 50 || distance > radius * 100) return;
    this.viewer.set({ camera: { ...camera, position: plus(camera.target, away, factor) } });
  }
}
