// @ts-check
/** A world drawn by WebGL. */

import { colourOf } from "./colours.js";
import { perspective, product, shadowOnto, unit, viewFrom } from "./matrix.js";
import { mesh } from "./meshes.js";
import { solidsOf } from "./motion.js";
import { FRAGMENT, VERTEX } from "./shaders.js";

const LIGHT = unit([0.45, 0.35, 1]);
const GROUND = { points: [-9, -9, 0, 0, 0, 1, 9, -9, 0, 0, 0, 1, 9, 9, 0, 0, 0, 1, -9, 9, 0, 0, 0, 1], indices: [0, 1, 2, 0, 2, 3] };
const IDENTITY = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
const VIEW_ANGLE = 0.65;
const KIND = { body: 0, ground: 1, plain: 2 };  // as the fragment shader has them

/** @typedef {{ array: WebGLVertexArrayObject, count: number }} Uploaded */

/**
 * Return the context of a canvas that has none yet; null without WebGL 2.
 *
 * @param {HTMLCanvasElement} canvas
 */
export const context = (canvas) => canvas.getContext("webgl2", { antialias: true, stencil: true, alpha: false });

/**
 * Return a painter of shapes on a canvas.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {WebGL2RenderingContext} gl
 * @param {Api.Shape[]} shapes
 * @returns {Page.Painter}
 */
export function painter(canvas, gl, shapes) {
  const program = link(gl);
  const uniform = Object.fromEntries(
    ["view", "model", "kind", "colour", "other", "sky", "light", "around", "scale"].map((name) => [name, gl.getUniformLocation(program, name)]));
  const solids = solidsOf(shapes);
  const uploaded = solids.map((shape) => upload(gl, program, mesh(shape)));
  const ground = upload(gl, program, GROUND);
  const line = gl.createBuffer();

  /** @type {(mesh: Uploaded, model: Page.Matrix, kind: number, colour: Page.Colour) => void} */
  function drawMesh({ array, count }, model, kind, colour) {
    gl.uniform1i(uniform.kind, kind);
    gl.uniform4fv(uniform.colour, colour);
    gl.uniformMatrix4fv(uniform.model, false, model);
    gl.bindVertexArray(array);
    gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_SHORT, 0);
  }

  /** @type {(palette: Page.Palette, camera: Page.Viewpoint) => void} */
  function drawGround(palette, { target: [x, y], scale }) {
    gl.uniform4fv(uniform.other, palette["floor-other"]);
    const model = IDENTITY.slice();
    for (const axis of [0, 5, 10]) model[axis] = scale;
    model.set([scale * Math.round(x / scale), scale * Math.round(y / scale)], 12);
    drawMesh(ground, model, KIND.ground, palette.floor);
  }

  /**
   * Darken each spot of the ground once, however many bodies are above it.
   *
   * @type {(models: Page.Matrix[], palette: Page.Palette, scale: number) => void}
   */
  function drawShadows(models, palette, scale) {
    const projection = shadowOnto(LIGHT, 0.001 * scale);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 1);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.depthMask(false);
    models.forEach((model, index) => drawMesh(uploaded[index], product(projection, model), KIND.plain, palette.shadow));
    gl.depthMask(true);
    gl.disable(gl.STENCIL_TEST);
  }

  /** @type {(path: Page.Vector[], palette: Page.Palette, scale: number) => void} */
  function drawPath(path, palette, scale) {
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ARRAY_BUFFER, line);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(path.flatMap(([x, y]) => [x, y, 0.003 * scale])), gl.DYNAMIC_DRAW);
    const attribute = gl.getAttribLocation(program, "place");
    gl.enableVertexAttribArray(attribute);
    gl.vertexAttribPointer(attribute, 3, gl.FLOAT, false, 0, 0);
    gl.uniform1i(uniform.kind, KIND.plain);
    gl.uniform4fv(uniform.colour, palette.trail);
    gl.uniformMatrix4fv(uniform.model, false, IDENTITY);
    gl.drawArrays(gl.LINE_STRIP, 0, path.length);
  }

  return (models, grounded, camera, palette, path) => {
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...palette.sky);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(program);
    const lens = perspective(VIEW_ANGLE, canvas.width / canvas.height, 0.05 * camera.scale, 40 * camera.scale);
    gl.uniformMatrix4fv(uniform.view, false, product(lens, viewFrom(camera.eye, camera.target, camera.up)));
    gl.uniform3fv(uniform.light, LIGHT);
    gl.uniform3fv(uniform.around, camera.target);
    gl.uniform4fv(uniform.sky, palette.sky);
    gl.uniform1f(uniform.scale, camera.scale);
    drawGround(palette, camera);
    drawShadows(models, palette, camera.scale);
    if (path.length > 1) drawPath(path, palette, camera.scale);
    solids.forEach((shape, index) =>
      drawMesh(uploaded[index], models[index], KIND.body, colourOf(shape, palette, grounded.has(shape.body))));
  };
}

/** @param {WebGL2RenderingContext} gl */
function link(gl) {
  const program = gl.createProgram();
  for (const { kind, source } of [{ kind: gl.VERTEX_SHADER, source: VERTEX }, { kind: gl.FRAGMENT_SHADER, source: FRAGMENT }]) {
    const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "WebGL failed");
  return program;
}

/**
 * @param {WebGL2RenderingContext} gl
 * @param {WebGLProgram} program
 * @param {import("./meshes.js").Mesh} mesh
 * @returns {Uploaded}
 */
function upload(gl, program, { points, indices }) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points), gl.STATIC_DRAW);
  ["place", "normal"].forEach((name, index) => {
    const attribute = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(attribute);
    gl.vertexAttribPointer(attribute, 3, gl.FLOAT, false, 24, 12 * index);
  });
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(indices), gl.STATIC_DRAW);
  return { array, count: indices.length };
}
