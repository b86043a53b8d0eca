// Pages opened from a disk may not start a worker, which the search is. There it runs in a hidden frame.
if (location.protocol === "file:") {
  window.IFrameWorker = window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      this.waiting = [];
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      this.window = frame.contentWindow;
      addEventListener("message", (event) => {
        if (event.source !== this.window) return;
        const copy = new MessageEvent("message", { data: event.data });
        this.dispatchEvent(copy);
        this.onmessage?.(copy);
      });
      const setup = `
        const up = parent;
        postMessage = (data) => up.postMessage(data, "*");
        importScripts = (...urls) => urls.reduce((before, url) => before.then(() => new Promise((done, failed) => {
          const script = document.createElement("script");
          Object.assign(script, { src: url, onload: done, onerror: failed });
          document.body.append(script);
        })), Promise.resolve());`;
      frame.onload = () => {
        for (const data of this.waiting) this.window.postMessage(data, "*");
        this.waiting = null;
      };
      this.window.document.write(`<body><script>${setup}</script><script src="${new URL(url, location)}"></script></body>`);
      this.window.document.close();
    }
    postMessage(data) {
      if (this.waiting) this.waiting.push(data);
      else this.window.postMessage(data, "*");
    }
    terminate() {}
  };
}
