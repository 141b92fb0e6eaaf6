// The photos of a turn in their order, which pointers and keys change.
import { make, refill, say, send, state } from "./api.js";
import { thumbnail } from "./photo_stage.js";

const STEPS = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 };
const ENDS = ["pointerup", "pointercancel", "dragend"]; // of a press

export class TurnOrder {
  // The page tells which photo is shown and the names of views.
  constructor(page) {
    this.page = page;
    this.list = make("ul", { class: "grid", "aria-label": "Order of the turn" });
    this.pressed = false; // a pointer is down on the list
    this.late = false; // the list is to be filled when it goes
  }

  // Fills the list. Under a pressed pointer it stays as it is until the pointer lets go: a
  // thumbnail that is replaced can be neither clicked nor dragged.
  fill() {
    this.late = this.pressed;
    if (this.pressed) return;
    this.list.dataset.order = numbers();
    refill(this.list, ...state.photos.map((photo, index) => this.item(photo, index)));
  }

  // Fills the list again where the order has changed.
  follow() {
    if (this.list.dataset.order !== numbers()) this.fill();
  }

  // Marks the photo that is shown.
  press(photo) {
    for (const button of this.list.querySelectorAll(".frame")) {
      const shown = button.dataset.key === `open ${photo.id}`;
      button.setAttribute("aria-pressed", String(shown));
    }
  }

  // Listens to pointers; returns what ends that.
  listen() {
    const release = (event) => this.release(event);
    this.list.addEventListener("pointerdown", () => { this.pressed = true; });
    for (const end of ENDS) window.addEventListener(end, release);
    return () => { for (const end of ENDS) window.removeEventListener(end, release); };
  }

  release(event) {
    const dragging = event.type === "pointercancel" && this.list.querySelector(".dragged");
    if (!this.pressed || dragging) return;
    setTimeout(() => {
      this.pressed = false;
      if (this.late) this.fill();
    });
  }

  item(photo, index) {
    const view = this.page.viewOf(photo);
    const frame = make("button", {
      class: "frame", "data-key": `open ${photo.id}`,
      "aria-label": `Photo ${index + 1}${view ? `, ${view.name}` : ""}`,
      "aria-pressed": String(photo.id === this.page.shown?.id),
      onclick: () => this.page.open(photo),
    }, thumbnail(photo, { draggable: "false" }));
    const item = make("li", { class: "card", draggable: "true" }, frame,
      make("span", { class: "name" },
        view ? `${view.name} ${Math.round(view.azimuth)}°` : `${index + 1}`),
      make("div", { class: "note" }, mover(photo, index, -1), mover(photo, index, 1)));
    listenToDrags(item, photo, index);
    item.addEventListener("keydown", (event) => {
      const step = STEPS[event.key];
      if (!event.altKey || !step) return;
      event.preventDefault();
      reorder(photo.id, index + step);
    });
    return item;
  }
}

function mover(photo, index, step) {
  const [name, sign] = step < 0 ? ["earlier", "‹"] : ["later", "›"];
  return make("button", {
    class: "plain step", "data-key": `${name} ${photo.id}`,
    "aria-label": `Photo ${index + 1} ${name} in the turn`,
    disabled: !state.photos[index + step], onclick: () => reorder(photo.id, index + step),
  }, sign);
}

function listenToDrags(item, photo, index) {
  item.addEventListener("dragstart", (event) => {
    event.dataTransfer.setData("text/plain", String(photo.id));
    item.classList.add("dragged");
  });
  item.addEventListener("dragend", () => item.classList.remove("dragged"));
  item.addEventListener("dragover", (event) => event.preventDefault());
  item.addEventListener("drop", (event) => {
    event.preventDefault();
    reorder(Number(event.dataTransfer.getData("text/plain")), index);
  });
}

function numbers() {
  return state.photos.map((photo) => photo.id).join();
}

async function reorder(id, to) {
  const order = state.photos.map((photo) => photo.id).filter((other) => other !== id);
  order.splice(Math.max(0, Math.min(order.length, to)), 0, id);
  try { await send("PUT", "/api/order", { order }); } catch (error) { say(error.message); }
}
