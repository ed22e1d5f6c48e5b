/** Agents of a crowd, drawn once for every heading and then copied: a thousand copies cost a tenth of a thousand outlines. */

export const DART = [[6.4, 0], [-4.6, 4.4], [-2.4, 0], [-4.6, -4.4]]; // about the ten units of a body, and which way it heads
const HEADINGS = 80;
const ROOM = 16; // units of length in a picture's side

/** Adds the outline of an agent to the path. */
export function dart(pen, x, y, angle, size) {
  const [cos, sin] = [Math.cos(angle) * size, Math.sin(angle) * size];
  for (let corner = 0; corner < 4; corner++) {
    const [along, aside] = DART[corner];
    const [toX, toY] = [x + along * cos - aside * sin, y + along * sin + aside * cos];
    if (corner) pen.lineTo(toX, toY);
    else pen.moveTo(toX, toY);
  }
  pen.closePath();
}

export class Sprites {
  constructor() {
    this.key = "";
  }

  /** Make the pictures: `scale` is pixels of the canvas a unit of length. */
  prepare(palette, scale, size, dots) {
    const key = `${palette.agent} ${scale} ${size}`;
    if (key === this.key) return;
    this.key = key;
    this.side = Math.ceil(ROOM * size * scale);
    this.sheet ??= document.createElement("canvas");
    this.sheet.width = this.side * HEADINGS;
    this.sheet.height = this.side * 2;
    const pen = this.sheet.getContext("2d");
    pen.lineJoin = "round";
    for (const fed of [0, 1]) {
      pen.fillStyle = fed ? palette.agent : palette.hungry;
      pen.strokeStyle = fed ? palette.map : palette.outline;
      pen.lineWidth = (fed ? 0.8 : 1.4) * dots;
      for (let heading = 0; heading < HEADINGS; heading++) {
        pen.beginPath();
        dart(pen, (heading + 0.5) * this.side, (fed + 0.5) * this.side, (heading * 2 * Math.PI) / HEADINGS, size * scale);
        pen.fill();
        pen.stroke();
      }
    }
  }

  /** Copy an agent to a place on the canvas, in its pixels. */
  draw(pen, x, y, angle, fed) {
    const { side } = this;
    const heading = Math.round((angle * HEADINGS) / (2 * Math.PI)) % HEADINGS;
    pen.drawImage(this.sheet, heading * side, fed ? side : 0, side, side, Math.round(x - side / 2), Math.round(y - side / 2), side, side);
  }
}
