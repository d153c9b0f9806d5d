// Studio: elements that draw on a canvas. Numbers come from the server; nothing here computes one of them.

import './drop.js';
import './plot.js';
import './drive.js';
import './robot.js';
import './run.js';
import './track.js';

document.documentElement.lang = 'en';
