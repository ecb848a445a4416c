// True if WebGL is available, tested once on a separate canvas.
const hasGraphics = document.createElement("canvas").getContext("webgl2") !== null;
