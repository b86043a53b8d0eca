// The panel beside the picture: labeled inputs that call back with what they were set to.

// An element with properties and children.
export const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};

// A slider with its value in words; `set` moves it without calling back.
export function slider(label, { min, max, step, value, said, changed }) {
  const input = make("input", { type: "range", min, max, step, value });
  const output = make("output", {}, said(value));
  const set = (number) => {
    input.value = number;
    output.textContent = said(Number(input.value));
    input.setAttribute("aria-valuetext", output.textContent);
  };
  input.addEventListener("input", () => {
    set(input.value);
    changed(Number(input.value));
  });
  set(value);
  // The first control in a label is the one that it names, and an output is one too.
  return { element: make("label", { className: "jaxsh-slider" }, label, input, output), set };
}

export function menu(label, names, changed) {
  const options = names.map((name, i) => make("option", { value: i }, name));
  const select = make("select", {}, ...options);
  select.addEventListener("change", () => changed(Number(select.value)));
  const set = (number) => (select.value = number);
  return { element: make("label", { className: "jaxsh-menu" }, label, select), set };
}

// A button that stays down until it is pressed again.
export function toggle(label, changed) {
  const element = make("button", { type: "button" }, label);
  const set = (on) => element.setAttribute("aria-pressed", on);
  element.addEventListener("click", () => {
    const on = element.getAttribute("aria-pressed") !== "true";
    set(on);
    changed(on);
  });
  set(false);
  return { element, set };
}

export function button(label, pressed) {
  const element = make("button", { type: "button" }, label);
  element.addEventListener("click", pressed);
  return { element };
}

// Radio buttons side by side; `set` chooses without calling back.
export function choice(label, names, changed) {
  const name = `jaxsh-choice-${++choices}`;
  const inputs = names.map((_, value) => make("input", { type: "radio", name, value }));
  inputs.forEach((input, i) => input.addEventListener("change", () => changed(i)));
  const set = (number) => (inputs[number].checked = true);
  const labels = names.map((one, i) => make("label", {}, inputs[i], make("span", {}, one)));
  const element = make("div", { className: "jaxsh-choice" }, ...labels);
  element.setAttribute("role", "radiogroup");
  element.setAttribute("aria-label", label);
  return { element, set };
}

let choices = 0;

// A control that shows what `read` takes of the state, whenever that has changed.
export const bound = (control, read) => ({
  ...control,
  show: (state) => control.set(read(state)),
});

// A control that is seen while `when` holds of the state.
export const seenIf = (when, control) => ({
  element: control.element,
  show: (state) => {
    control.element.hidden = !when(state);
    control.show(state);
  },
});

// Controls under a heading that folds them away.
export function group(title, controls, buttons = [], open = true) {
  const element = make("details", { open }, make("summary", {}, title));
  element.append(...controls.map((control) => control.element));
  if (buttons.length) {
    element.append(make("div", { className: "jaxsh-buttons" }, ...buttons.map((one) => one.element)));
  }
  return { element };
}

// Pairs of words, as a list.
export function words(pairs) {
  return make("dl", {}, ...pairs.map(([term, said]) =>
    make("div", {}, make("dt", {}, term), make("dd", {}, said))));
}

export function panelOf(title, groups) {
  const elements = groups.map((one) => one.element);
  return make("div", { className: "jaxsh-panel" }, make("h1", {}, title), ...elements);
}
