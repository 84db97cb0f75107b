"use strict";
(async () => {
  if (!("DecompressionStream" in window)) {
    document.body.prepend("The figures need a browser of 2023 or later.");
    return;
  }
  // Base64 of a gzip file
  const unpacked = async (anchor) => {
    const text = document.getElementById(anchor).textContent;
    const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).text();
  };

  const library = document.createElement("script");
  library.textContent = await unpacked("plotly");
  document.head.append(library);
  const plots = JSON.parse(await unpacked("plots"));
  const drawings = Object.keys(plots).map((anchor) => document.getElementById(anchor));

  // Without a pointer that hovers, dragging must scroll the page and a tool bar would lie on the
  // drawing for good.
  const pointer = window.matchMedia("(hover: hover) and (min-width: 641px)").matches;
  const settings = {
    displaylogo: false,
    displayModeBar: pointer ? "hover" : false,
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d", "zoomIn2d", "zoomOut2d"],
  };
  for (const drawing of drawings) {
    const { data, layout } = plots[drawing.id];
    Plotly.newPlot(drawing, data, { ...layout, dragmode: pointer ? "zoom" : false }, settings);
  }

  const resized = new ResizeObserver((entries) => {
    for (const { target } of entries) Plotly.Plots.resize(target);
  });
  for (const drawing of drawings) resized.observe(drawing);

  // A drawing keeps its size in pixels; on paper it must fit the column it stands in (180 mm of an
  // A4 page, or half of that without the gap), and be low enough for two to share a page.
  const full = 680;
  const half = 328;
  const lower = 0.72;
  const heights = new Map(drawings.map((drawing) => [drawing, drawing.clientHeight]));
  const set = (drawing, width, height) => {
    drawing.style.height = `${height}px`;
    Plotly.relayout(drawing, { width: width, height: width && height, autosize: !width });
  };
  window.addEventListener("beforeprint", () => {
    for (const [drawing, height] of heights) {
      set(drawing, drawing.closest(".grid") ? half : full, Math.round(lower * height));
    }
  });
  window.addEventListener("afterprint", () => {
    for (const [drawing, height] of heights) set(drawing, null, height);
  });
})();
