/** What agents see: the disc of each, its three sectors, and those in which it senses food. */

const DEGREE = Math.PI / 180;
const SECTORS = [
  [-45, -15],
  [-15, 15],
  [15, 45],
].map((edges) => edges.map((degrees) => degrees * DEGREE)); // left, front, right
const MANY = 60; // agents beyond which only the chosen one's is drawn, unless discs are large on the canvas

/** Overlapping discs do not add up: all of them are one shape. @param {import("./world.js").WorldView} view */
export function drawSight(view, recording, step, { palette, chosen }) {
  const { pen, scale } = view;
  const {
    agents,
    first,
    header: { visual_radius: radius },
    arrays: { sensor },
  } = recording;
  const all = agents <= MANY || radius * scale > 90;
  const seen = all ? agentsNear(view, radius) : chosen != null && chosen < agents ? [chosen] : [];
  const shape = (draw) => {
    pen.beginPath();
    for (const agent of seen) copies(view, agent, radius, (x, y) => draw(agent, x, y));
  };
  shape((agent, x, y) => {
    pen.moveTo(x + radius, y);
    pen.arc(x, y, radius, 0, 2 * Math.PI);
  });
  pen.fillStyle = palette.sight;
  pen.globalAlpha = 0.055;
  pen.fill();
  shape((agent, x, y) => SECTORS.forEach((edges) => wedge(pen, x, y, radius, view.angle[agent], edges)));
  pen.strokeStyle = palette.sight;
  pen.lineWidth = 1 / scale;
  pen.globalAlpha = 0.17;
  pen.stroke();
  const codes = (step - first) * agents;
  const fires = (agent, side) => (sensor[codes + agent] >> side) & 1;
  shape((agent, x, y) =>
    SECTORS.forEach((edges, side) => fires(agent, side) && wedge(pen, x, y, radius, view.angle[agent], edges)),
  );
  pen.fillStyle = palette.lit;
  pen.globalAlpha = 0.42;
  pen.fill();
  pen.globalAlpha = 1;
}

function wedge(pen, x, y, radius, angle, [from, to]) {
  pen.moveTo(x, y);
  pen.arc(x, y, radius, angle + from, angle + to);
  pen.closePath();
}

/** The agents of whose surroundings anything may be on the canvas. */
function agentsNear(view, radius) {
  const { width, height } = view.world;
  const [left, top] = view.toWorld(0, 0);
  const [right, bottom] = view.toWorld(view.width, view.height);
  const found = [];
  for (let agent = 0; agent < view.count; agent++) {
    const [x, y] = [view.x[agent], view.y[agent]];
    const wraps = x < radius || y < radius || x > width - radius || y > height - radius;
    if (wraps || (x > left - radius && x < right + radius && y > top - radius && y < bottom + radius)) found.push(agent);
  }
  return found;
}

/** Draws what is round an agent, and again on the other side where it reaches across the edge of the torus. */
function copies({ x: allX, y: allY, world: { width, height } }, agent, radius, draw) {
  const [x, y] = [allX[agent], allY[agent]];
  const acrossX = x < radius ? width : x > width - radius ? -width : 0;
  const acrossY = y < radius ? height : y > height - radius ? -height : 0;
  draw(x, y);
  if (acrossX) draw(x + acrossX, y);
  if (acrossY) draw(x, y + acrossY);
  if (acrossX && acrossY) draw(x + acrossX, y + acrossY);
}
