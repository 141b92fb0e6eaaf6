// The law of JavaScript in the studio's pages; `.ci/eslint` checks it.

const browser = [
  "addEventListener", "Blob", "clearInterval", "clearTimeout", "createImageBitmap",
  "devicePixelRatio", "document", "DOMParser", "EventSource", "fetch", "history",
  "HTMLButtonElement", "HTMLInputElement", "HTMLSelectElement", "Image", "location", "navigator",
  "Path2D", "performance", "removeEventListener", "requestAnimationFrame", "ResizeObserver",
  "setInterval", "setTimeout", "sessionStorage", "speechSynthesis", "SpeechSynthesisUtterance", "TextDecoder", "URL",
  "URLSearchParams", "window",
];

export default [
  {
    files: ["**/*.js"],
    languageOptions: { globals: Object.fromEntries(browser.map((name) => [name, "readonly"])) },
    linterOptions: { noInlineConfig: true },
    rules: {
      eqeqeq: ["error", "always", { null: "ignore" }], // `== null` is null or undefined
      "max-len": ["error", { code: 100 }],
      "max-lines": ["error", 400],
      "max-lines-per-function": ["error", 40],
      "no-undef": "error",
      "no-unused-vars": "error",
      "prefer-const": "error",
    },
  },
];
