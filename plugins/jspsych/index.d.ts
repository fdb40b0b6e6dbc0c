import type { JsPsych, JsPsychPlugin, TrialType } from "jspsych";

/** Planes of focus of a picture, as `focalgradient focus-series --web` writes them into focus.json. */
export interface PackedSeries {
  width: number;
  height: number;
  /** Of the planes, in dioptres, rising. */
  vergences: number[];
  bits: 8 | 16;
  gain: number;
  data: string;
}

/** A row of data that plugins with frames have in common. */
export interface Frames {
  dropped_frames: number;
  /** What happened to the page meanwhile. */
  lost: { hidden: number; left_full_screen: number; zoomed: number };
}

type Info = { name: string; version: string; parameters: Record<string, any>; data: Record<string, any> };

/** A picture pixel for pixel, as its file has it. */
export declare class FocalPicture implements JsPsychPlugin<Info> {
  static info: Info;
  constructor(jsPsych: JsPsych);
  trial(display_element: HTMLElement, trial: TrialType<Info>): Promise<void>;
  simulate(trial: TrialType<Info>, mode: "data-only" | "visual", options: any, loaded: () => void): Promise<void>;
}

/** A picture refocused at every frame: by a number, by a function of seconds, or by the participant. */
export declare class FocalBlur implements JsPsychPlugin<Info> {
  static info: Info;
  constructor(jsPsych: JsPsych);
  trial(display_element: HTMLElement, trial: TrialType<Info>): Promise<void>;
  simulate(trial: TrialType<Info>, mode: "data-only" | "visual", options: any, loaded: () => void): Promise<void>;
}

/** The turning Necker cube, blurred by the depth of one of its two readings. */
export declare class FocalCube implements JsPsychPlugin<Info> {
  static info: Info;
  constructor(jsPsych: JsPsych);
  trial(display_element: HTMLElement, trial: TrialType<Info>): Promise<void>;
  simulate(trial: TrialType<Info>, mode: "data-only" | "visual", options: any, loaded: () => void): Promise<void>;
}

export interface Measured {
  /** Of the display's own pixels. */
  pixels_per_degree: number;
  viewing_distance_mm: number;
  /** Of the page's pixels (CSS). */
  pixels_per_mm: number;
}

export interface DistanceOptions {
  language?: "en" | "de";
  /** Texts of one's own, by name: web.card, web.card_done, web.blind_spot, ... */
  texts?: Record<string, string>;
  on_measured?: (measured: Measured) => void;
}

/** A node of a timeline: size of the screen by a bank card, distance by the blind spot. */
export declare function focalDistance(jsPsych: JsPsych, options?: DistanceOptions): Record<string, any>;

export interface CubeSizes {
  size_deg: number;
  perspective: number;
  distance_m: number;
  tilt_deg: number;
  line_deg?: number | null;
  turns_per_s: number;
  strength_mm: number;
  pixels_per_degree: number;
  gamma?: number | null;
}

/** Sizes of a cube as it is drawn, in pixels of the display. */
export declare function cubeOf(sizes: CubeSizes): Record<string, number>;
