// Pages opened from a disk may not start a worker, which the search is. There it runs in a hidden frame.
if (location.protocol === "file:") {
  window.IFrameWorker = window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      const inside = frame.contentWindow;
      inside.answer = (data) => {
        const message = new MessageEvent("message", { data });
        this.dispatchEvent(message);
        this.onmessage?.(message);
      };
      const setup = `
        postMessage = (data) => setTimeout(answer, 0, data);
        importScripts = (...urls) => urls.reduce((before, url) => before.then(() => new Promise((done, failed) => {
          const script = document.createElement("script");
          Object.assign(script, { src: url, onload: done, onerror: failed });
          document.body.append(script);
        })), Promise.resolve());`;
      inside.document.write(`<body><script>${setup}</script><script src="${new URL(url, location)}"></script></body>`);
      this.ready = new Promise((done) => inside.addEventListener("load", done));
      inside.document.close();
      this.postMessage = async (data) => {
        await this.ready;
        inside.dispatchEvent(new inside.MessageEvent("message", { data }));
      };
    }
    terminate() {}
  };
}
