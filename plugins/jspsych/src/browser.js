// For pages without modules: the same under one global name.
import * as plugins from "./index.js";

globalThis.focalgradient = plugins;
