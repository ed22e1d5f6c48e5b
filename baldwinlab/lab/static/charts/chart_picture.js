/** The picture of a chart as a PNG file, with its title, its legend and a note. */

import { el } from "../core/common.js";
import { palette } from "../core/palette.js";

// CSS pixels.
const MARGIN = 12;
const ROW = 22;
const LINE_LENGTH = 22;

/**
 * Return a PNG file.
 * @param {HTMLCanvasElement} plot is visible
 * @param {string} title
 * @param {{label: string, color?: string, dash?: number[]}[]} [keys] of the legend
 * @param {string} [note] below the legend
 * @returns {Promise<Blob>}
 */
export function drawPicture(plot, title, keys = [], note = "") {
  const { clientWidth: width, clientHeight: height } = plot;
  const rows = note ? [...keys, { label: note }] : keys;
  const bottom = MARGIN + ROW + height;
  const scale = plot.width / width;
  const canvas = el("canvas", {
    width: (width + 2 * MARGIN) * scale,
    height: (bottom + ROW * rows.length + MARGIN) * scale,
  });
  const pen = canvas.getContext("2d");
  pen.scale(scale, scale);
  pen.fillStyle = palette.surface;
  pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.drawImage(plot, MARGIN, MARGIN + ROW, width, height);
  pen.fillStyle = palette.text;
  pen.font = `600 14px ${palette.font}`;
  pen.fillText(title, MARGIN, MARGIN + 12);
  pen.font = `12px ${palette.font}`;
  rows.forEach((row, index) => drawRow(pen, row, bottom + ROW * (index + 1)));
  return new Promise((resolve) => canvas.toBlob(resolve));
}

/** Draw an entry of the legend, or the note, which has no color. */
function drawRow(pen, { label, color = "", dash = [] }, y) {
  if (color) {
    pen.strokeStyle = color;
    pen.lineWidth = 3;
    pen.setLineDash(dash);
    pen.beginPath();
    pen.moveTo(MARGIN, y - 4);
    pen.lineTo(MARGIN + LINE_LENGTH, y - 4);
    pen.stroke();
  }
  pen.fillText(label, color ? MARGIN + LINE_LENGTH + 6 : MARGIN, y);
}
