// What is said to the user: shown, and spoken where that is wanted.
import { make } from "./api.js";

const AGAIN_S = 2.2; // seconds between two spoken prompts

export class Voice {
  constructor(text) {
    this.hint = make("p", { class: "hint", role: "status", "aria-live": "polite" }, text);
    this.aloud = true;
    this.last = { text: "", time: 0 };
  }

  // What is said at once is not held back, and ends what is being said.
  tell(text, spoken = text, atOnce = false) {
    if (this.hint.textContent !== text) this.hint.textContent = text;
    if (!this.aloud || !spoken || !window.speechSynthesis) return;
    const time = performance.now() / 1000;
    const due = spoken !== this.last.text && time - this.last.time > AGAIN_S;
    if (!atOnce && !due) return;
    if (atOnce) speechSynthesis.cancel();
    speechSynthesis.speak(new SpeechSynthesisUtterance(spoken));
    this.last = { text: spoken, time };
  }

  end() {
    window.speechSynthesis?.cancel();
  }
}
