// The plugins of focalgradient for jsPsych 8.
export { default as FocalBlur } from "./focal-blur.js";
export { default as FocalCube, cubeOf } from "./focal-cube.js";
export { focalDistance } from "./focal-distance.js";
export { default as FocalPicture } from "./focal-picture.js";
