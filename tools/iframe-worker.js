// Search in pages that are opened as files: there browsers start no worker, so its script runs in a hidden frame.
// The theme asks for this by the name IFrameWorker and would fetch it from another host.
if (location.protocol === "file:") {
  window.IFrameWorker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.appendChild(frame);
      this.inner = frame.contentWindow;
      addEventListener("message", event => {
        if (event.source !== this.inner) return;
        const heard = new MessageEvent("message", {data: event.data});
        this.dispatchEvent(heard);
        if (this.onmessage) this.onmessage(heard);
      });
      const script = document.createElement("a");
      script.href = url;
      this.inner.document.open();
      this.ready = new Promise(resolve => { this.inner.addEventListener("worker", resolve, {once: true}); });
      this.inner.document.write(`<!doctype html><body><script>
        postMessage = data => parent.dispatchEvent(new MessageEvent("message", {data, source: window}));
        importScripts = (...urls) => urls.reduce((done, url) => done.then(() => new Promise((resolve, reject) => {
          const script = document.createElement("script");
          script.src = url; script.onload = resolve; script.onerror = reject;
          document.body.appendChild(script);
        })), Promise.resolve());
      <\/script><script src="${script.href.replace(/"/g, "%22")}" onload="window.dispatchEvent(new Event('worker'))"><\/script>`);
      this.inner.document.close();
    }
    postMessage(data) {
      this.ready.then(() => this.inner.dispatchEvent(new MessageEvent("message", {data})));
    }
    terminate() {}
  };
  window.Worker = window.IFrameWorker;
}
