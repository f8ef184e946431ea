/** A world drawn by WebGL. */

import { colourOf } from "./colours.js";
import { flattened, look, perspective, times, unit } from "./matrix.js";
import { mesh } from "./meshes.js";
import { FRAGMENT, VERTEX } from "./shaders.js";

const LIGHT = unit([0.45, 0.35, 1]);
const GROUND = { points: [-9, -9, 0, 0, 0, 1, 9, -9, 0, 0, 0, 1, 9, 9, 0, 0, 0, 1, -9, 9, 0, 0, 0, 1], indices: [0, 1, 2, 0, 2, 3] };
const UNMOVED = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
const ANGLE = 0.65;

/** Whether the canvas can be drawn on so; asked of a canvas that nothing else was asked of. */
export const context = (canvas) => canvas.getContext("webgl2", { antialias: true, stencil: true, alpha: false });

/**
 * Draws shapes on a canvas with such a context: `draw(models, down, camera, palette, trail)`, where `models` has a matrix
 * for each shape, and `down` the bodies that are on the ground.
 */
export function painter(canvas, gl, shapes) {
  const program = linked(gl);
  const place = (name) => gl.getUniformLocation(program, name);
  const at = Object.fromEntries(["view", "model", "kind", "colour", "other", "sky", "light", "around"].map((name) => [name, place(name)]));
  const solids = shapes.filter((each) => each.kind !== "plane");
  const uploaded = solids.map((each) => upload(gl, program, mesh(each)));
  const ground = upload(gl, program, GROUND);
  const line = gl.createBuffer();

  function solid(number, model, kind, colour) {
    gl.uniform1i(at.kind, kind);
    gl.uniform4fv(at.colour, colour);
    gl.uniformMatrix4fv(at.model, false, model);
    gl.bindVertexArray(uploaded[number].array);
    gl.drawElements(gl.TRIANGLES, uploaded[number].count, gl.UNSIGNED_SHORT, 0);
  }

  function floor(palette, around) {
    gl.uniform1i(at.kind, 1);
    gl.uniform4fv(at.colour, palette.floor);
    gl.uniform4fv(at.other, palette["floor-other"]);
    const model = UNMOVED.slice();
    model.set([Math.round(around[0]), Math.round(around[1])], 12);
    gl.uniformMatrix4fv(at.model, false, model);
    gl.bindVertexArray(ground.array);
    gl.drawElements(gl.TRIANGLES, ground.count, gl.UNSIGNED_SHORT, 0);
  }

  /** Each spot of the ground is darkened once, however many bodies are above it. */
  function shadows(models, palette) {
    const flat = flattened(LIGHT, 0.001);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 1);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.depthMask(false);
    models.forEach((model, number) => solid(number, times(flat, model), 2, palette.shadow));
    gl.depthMask(true);
    gl.disable(gl.STENCIL_TEST);
  }

  function trailed(points, palette) {
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ARRAY_BUFFER, line);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points.flatMap(([x, y]) => [x, y, 0.003])), gl.DYNAMIC_DRAW);
    const attribute = gl.getAttribLocation(program, "place");
    gl.enableVertexAttribArray(attribute);
    gl.vertexAttribPointer(attribute, 3, gl.FLOAT, false, 0, 0);
    gl.uniform1i(at.kind, 2);
    gl.uniform4fv(at.colour, palette.trail);
    gl.uniformMatrix4fv(at.model, false, UNMOVED);
    gl.drawArrays(gl.LINE_STRIP, 0, points.length);
  }

  return function draw(models, down, camera, palette, trail) {
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...palette.sky);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(program);
    const lens = perspective(ANGLE, canvas.width / canvas.height, 0.05, 40);
    gl.uniformMatrix4fv(at.view, false, times(lens, look(camera.eye, camera.target)));
    gl.uniform3fv(at.light, LIGHT);
    gl.uniform3fv(at.around, camera.target);
    gl.uniform4fv(at.sky, palette.sky);
    floor(palette, camera.target);
    shadows(models, palette);
    if (trail.length > 1) trailed(trail, palette);
    solids.forEach((shape, number) => solid(number, models[number], 0, colourOf(shape, palette, down.has(shape.body))));
  };
}

function linked(gl) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "WebGL failed");
  return program;
}

function upload(gl, program, { points, indices }) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points), gl.STATIC_DRAW);
  ["place", "normal"].forEach((name, number) => {
    const attribute = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(attribute);
    gl.vertexAttribPointer(attribute, 3, gl.FLOAT, false, 24, 12 * number);
  });
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(indices), gl.STATIC_DRAW);
  return { array, count: indices.length };
}
