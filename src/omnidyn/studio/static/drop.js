// A place to drop files on, or to click
class Drop extends HTMLElement {
  connectedCallback() {
    if (this.input) return;
    this.tabIndex = 0;
    this.setAttribute('role', 'button');
    this.say(this.getAttribute('words') || 'Drop a log here, or click');
    this.input = document.createElement('input');
    this.input.type = 'file'; this.input.multiple = true; this.input.hidden = true;
    this.after(this.input);
    this.input.onchange = (e) => { this.take(e.target.files); }; // the element may be gone by now: another tab
    this.onclick = () => this.input.click();
    this.onkeydown = (e) => { if (e.key === 'Enter' || e.key === ' ') { e.preventDefault(); this.input.click(); } };
    this.ondragover = (e) => { e.preventDefault(); this.classList.add('over'); };
    this.ondragleave = () => this.classList.remove('over');
    this.ondrop = (e) => { e.preventDefault(); this.classList.remove('over'); this.take(e.dataTransfer.files); };
  }
  disconnectedCallback() { if (this.input) this.input.remove(); this.input = null; }
  say(words) { this.textContent = words; }
  async take(files) {
    for (const file of files) {
      this.say(`Reading ${file.name} ...`);
      const fault = await this.send(file);
      this.say(fault ? `${file.name} was not taken: ${fault}` : this.getAttribute('words') || 'Drop a log here, or click');
    }
  }
  send(file) { // what is wrong, or nothing; fetch tells nothing of its progress
    const refused = 'the studio did not answer';
    return new Promise((done) => {
      const request = new XMLHttpRequest();
      request.open('POST', `/upload?name=${encodeURIComponent(file.name)}&kind=${this.getAttribute('kind') || ''}`);
      request.upload.onprogress = (e) => this.say(`Reading ${file.name}, ${Math.floor(100 * e.loaded / e.total)} %`);
      request.onload = () => done(request.status === 200 ? '' : [400, 413].includes(request.status) ? JSON.parse(request.responseText).error : refused);
      request.onerror = () => done(refused);
      request.send(file);
    });
  }
}

customElements.define('omni-drop', Drop);
