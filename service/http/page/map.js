// The map: shaded ground, the colours of an answer over it, a marker for each anchor.

const by = (id) => document.getElementById(id);
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

export class MapView {
  // placed(east_m, north_m): somebody clicked; moved(anchor, east_m, north_m), removed(anchor): a marker was used.
  constructor({ placed, moved, removed }) {
    Object.assign(this, { placed, moved, removed, dem: null });
    const map = by("map");
    map.addEventListener("click", (event) => {
      if (event.target.closest(".marker")) return;
      this.placed(...this.metresAt(event));
    });
    map.addEventListener("pointermove", (event) => {
      const [east, north] = this.metresAt(event);
      by("pointer").textContent = `east ${east.toFixed(0)} m, north ${north.toFixed(0)} m`;
    });
    by("opacity").addEventListener("input", (event) => { by("overlay").style.opacity = event.target.value; });
    new ResizeObserver(() => this.drawScale()).observe(map);
  }

  show(dem) {
    const posts = dem.bounds_of_posts_m;
    // pictures reach to the corners of the outermost cells, half a cell beyond their posts
    const [east, north] = [dem.cell_east_m / 2, dem.cell_north_m / 2];
    this.west = posts.west - east;
    this.north = posts.north + north;
    this.width = posts.east + east - this.west;
    this.height = this.north - (posts.south - north);
    this.dem = dem;
    const map = by("map");
    map.style.aspectRatio = `${this.width} / ${this.height}`;
    map.style.maxWidth = `calc(82vh * ${this.width / this.height})`;
    by("hillshade").src = dem.links.hillshade;
    this.cover(null, "");
    for (const id of ["map", "under"]) by(id).hidden = false;
    by("empty").hidden = true;
    this.drawScale();
  }

  cover(picture, words) {
    const overlay = by("overlay");
    overlay.hidden = picture === null;
    overlay.alt = words;
    if (picture === null) overlay.removeAttribute("src");
    else overlay.src = picture;
  }

  middle() {
    return [this.west + this.width / 2, this.north - this.height / 2];
  }

  metresAt(event) {
    const box = by("map").getBoundingClientRect();
    const part = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    const [across, down] = part.map((share) => Math.min(Math.max(share, 0), 1));
    // finer than anybody can point on ground of that size
    const parts = this.dem.cell_east_m >= 5 ? 1 : 10;
    return [this.west + across * this.width, this.north - down * this.height].map((m) => Math.round(m * parts) / parts);
  }

  mark(anchors) {
    const markers = by("markers");
    const focused = document.activeElement?.closest?.(".marker")?.dataset.key;
    markers.replaceChildren(...anchors.map((anchor) => this.marker(anchor)));
    if (focused) markers.querySelector(`[data-key="${focused}"]`)?.focus();
  }

  marker(anchor) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "marker";
    button.dataset.key = anchor.key;
    button.setAttribute("aria-label", `Anchor ${anchor.id}: arrow keys move it, Delete removes it`);
    button.append(Object.assign(document.createElement("span"), { textContent: anchor.id }));
    this.place(button, anchor.east_m, anchor.north_m);
    button.addEventListener("keydown", (event) => {
      if (event.key === "Delete") this.removed(anchor);
      const move = MOVES[event.key];
      if (!move) return;
      event.preventDefault();
      const cells = event.shiftKey ? 10 : 1;
      const east = anchor.east_m + move[0] * cells * this.dem.cell_east_m;
      this.moved(anchor, east, anchor.north_m + move[1] * cells * this.dem.cell_north_m);
    });
    button.addEventListener("pointerdown", (event) => {
      button.setPointerCapture(event.pointerId);
      let at = null;
      button.onpointermove = (moving) => {
        at = this.metresAt(moving);
        this.place(button, ...at);
      };
      button.onpointerup = button.onpointercancel = () => {
        button.onpointermove = button.onpointerup = button.onpointercancel = null;
        if (at) this.moved(anchor, ...at);
      };
    });
    return button;
  }

  place(button, east, north) {
    const across = (east - this.west) / this.width;
    const down = (this.north - north) / this.height;
    const inside = across >= 0 && across <= 1 && down >= 0 && down <= 1;
    button.classList.toggle("outside", !inside);
    button.classList.toggle("left", across > 0.85);
    // one outside the ground waits at the border
    button.style.left = `${100 * Math.min(Math.max(across, 0.01), 0.99)}%`;
    button.style.top = `${100 * Math.min(Math.max(down, 0.01), 0.99)}%`;
  }

  drawScale() {
    if (!this.dem) return;
    const pixels = by("map").clientWidth;
    const most = this.width / 5;
    const power = 10 ** Math.floor(Math.log10(most));
    const length = [5, 2, 1].map((digit) => digit * power).find((m) => m <= most);
    by("scale-bar").style.width = `${(pixels * length) / this.width}px`;
    by("scale-length").textContent = length >= 1000 ? `${length / 1000} km` : `${length} m`;
  }
}
