// What the colors of a picture stand for: a bar, or a patch for each level, drawn in a canvas.
import { RAMP, cssColor, levelColors } from "./ramp.js";

const PAD = 10;
const WIDTH = 220;
const FONT = "12px system-ui, sans-serif";

// At most four significant digits.
export function shortNumber(x) {
  if (x === 0) return "0";
  const size = Math.abs(x);
  const text = size < 1e-3 || size >= 1e5 ? x.toExponential(2) : String(Number(x.toPrecision(4)));
  return text.replace("-", "−");
}

// `facts` have a title, and labels of levels, or `low`, `high` and whether there is more beyond these:
// `under`, `over`. Height and width in pixels of the page.
export function barHeight(facts) {
  return facts.labels ? 30 + 20 * facts.labels.length + PAD : 64;
}

export function barWidth(facts) {
  if (!facts.labels) return WIDTH;
  const context = document.createElement("canvas").getContext("2d");
  context.font = FONT;
  const wide = (text) => context.measureText(text).width;
  const widest = Math.max(wide(facts.title), ...facts.labels.map((label) => 32 + wide(label)));
  return Math.min(WIDTH, Math.ceil(widest) + 2 * PAD);
}

// Draws with its upper left corner where the context's origin is; `ink` and `ground` are colors.
export function drawBar(context, facts, ink, ground) {
  const height = barHeight(facts);
  context.save();
  context.font = FONT;
  context.textBaseline = "middle";
  context.fillStyle = ground;
  context.beginPath();
  context.roundRect(0, 0, barWidth(facts), height, 6);
  context.fill();
  context.fillStyle = ink;
  context.fillText(facts.title, PAD, 16, WIDTH - 2 * PAD);
  if (facts.labels) levelPatches(context, facts.labels, ink);
  else ramp(context, facts, ink);
  context.restore();
}

function levelPatches(context, labels, ink) {
  // The highest on top, as on an axis.
  levelColors(labels.length).forEach((color, i) => {
    const y = 30 + 20 * (labels.length - 1 - i);
    context.fillStyle = cssColor(color);
    context.fillRect(PAD, y, 24, 14);
    context.fillStyle = ink;
    context.fillText(labels[i], PAD + 32, y + 7, WIDTH - 2 * PAD - 32);
  });
}

// As `FalseColor` shows what is below the ramp.
function stripes(context, top, thick) {
  context.save();
  context.fillStyle = "rgb(191 191 191)";
  context.fillRect(PAD, top, 18, thick);
  context.beginPath();
  context.rect(PAD, top, 18, thick);
  context.clip();
  context.strokeStyle = "rgb(115 115 115)";
  context.lineWidth = 2.8;
  for (let x = -thick; x < 30; x += 6) {
    context.beginPath();
    context.moveTo(PAD + x, top);
    context.lineTo(PAD + x + thick, top + thick);
    context.stroke();
  }
  context.restore();
}

function ramp(context, { low, high, under, over }, ink) {
  const [top, thick] = [28, 12];
  const left = PAD + (under ? 30 : 0);
  const width = WIDTH - PAD - left;
  const gradient = context.createLinearGradient(left, 0, left + width, 0);
  RAMP.forEach((color, i) => gradient.addColorStop(i / (RAMP.length - 1), cssColor(color)));
  context.fillStyle = gradient;
  context.fillRect(left, top, width, thick);
  if (under) {
    stripes(context, top, thick);
    context.fillStyle = ink;
    context.textAlign = "center";
    context.fillText("< 0", PAD + 9, top + thick + 11);
  }
  context.fillStyle = ink;
  [low, (low + high) / 2, high].forEach((x, i) => {
    context.textAlign = ["left", "center", "right"][i];
    context.fillRect(left + (i * (width - 1)) / 2, top + thick, 1, 3);
    context.fillText((over && i === 2 ? "≥ " : "") + shortNumber(x), left + (i * width) / 2, top + thick + 11);
  });
}
