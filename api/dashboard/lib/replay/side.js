/** A world drawn flat, as it looks from the side: where there is no WebGL. */

import { colourOf, css } from "./colours.js";
import { moved } from "./matrix.js";

const METRES_HIGH = 0.6;

/** Draws as the painter of WebGL does, without depth; the camera's direction is the horizontal one that it has. */
export function painter(canvas, shapes) {
  const pen = canvas.getContext("2d");
  const solids = shapes.filter((each) => each.kind !== "plane");
  return function draw(models, down, camera, palette) {
    const scale = (canvas.height / METRES_HIGH) * (1.6 / camera.distance);
    const away = Math.atan2(camera.eye[1] - camera.target[1], camera.eye[0] - camera.target[0]);
    const flat = ([x, y, z]) => [
      canvas.width / 2 + scale * (-(x - camera.target[0]) * Math.sin(away) + (y - camera.target[1]) * Math.cos(away)),
      0.8 * canvas.height - scale * z,
    ];
    pen.fillStyle = css(palette.sky);
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.fillStyle = css(palette.floor);
    pen.fillRect(0, 0.8 * canvas.height, canvas.width, canvas.height);
    solids.forEach((shape, number) => {
      pen.strokeStyle = pen.fillStyle = css(colourOf(shape, palette, down.has(shape.body)));
      outline(pen, shape, models[number], flat, scale);
    });
  };
}

function outline(pen, { kind, size_m: size }, model, flat, scale) {
  pen.beginPath();
  pen.lineCap = "round";
  if (kind === "box") {
    pen.lineWidth = 2;
    for (const [from, to] of edges(size)) {
      pen.moveTo(...flat(moved(model, from)));
      pen.lineTo(...flat(moved(model, to)));
    }
    pen.stroke();
  } else if (kind === "sphere") {
    pen.arc(...flat(moved(model, [0, 0, 0])), scale * size[0], 0, 2 * Math.PI);
    pen.fill();
  } else {
    pen.lineWidth = 2 * scale * size[0];
    pen.moveTo(...flat(moved(model, [0, 0, size[1] / 2])));
    pen.lineTo(...flat(moved(model, [0, 0, -size[1] / 2])));
    pen.stroke();
  }
}

/** The twelve edges of a box. */
function edges(size) {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((bits) => size.map((each, k) => ((bits >> k) & 1 ? each : -each) / 2));
  return corners.flatMap((from, bits) => [1, 2, 4].filter((bit) => !(bits & bit)).map((bit) => [from, corners[bits | bit]]));
}
