/* The texts, English and German. */
export let language = navigator.language.startsWith("de") ? "de" : "en";

export const speak = chosen => { language = chosen; };

export const word = key => {
  const found = WORDS[key];
  if (!found) throw new Error(`no words for ${key}`);
  return found[language === "de" ? 1 : 0];
};

export const decimal = (value, digits) => {
  const text = value.toFixed(digits).replace("-", "−");
  return language === "de" ? text.replace(".", ",") : text;
};

/* An f-number, without a decimal that is 0. */
export const stop = number => `f/${decimal(number, Math.abs(number - Math.round(number)) < 0.05 ? 0 : 1)}`;

export const WORDS = {
  title: ["A New Sense for Depth of Field: the figures, live", "Ein neuer Sinn für Tiefe: die Abbildungen zum Ausprobieren"],
  intro: [
    "A lens blurs each point according to its distance from the plane of focus, and this blur gives the distance back (A. P. Pentland, 1987). Everything here is computed in this page, at every change.",
    "Eine Linse zeichnet jeden Punkt je nach Abstand von der Schärfeebene unscharf, und aus dieser Unschärfe folgt die Entfernung (A. P. Pentland, 1987). Alles hier wird in dieser Seite berechnet, bei jeder Änderung.",
  ],
  footer: [
    "The page stores nothing and sends nothing. Scene, tables and simulated observers: focalgradient (<code>docs/play/make.py</code>).",
    "Die Seite speichert nichts und sendet nichts. Szene, Tabellen und simulierte Beobachter: focalgradient (<code>docs/play/make.py</code>).",
  ],
  noWebgl: ["This browser has no WebGL 2, which this panel needs.", "Dieser Browser hat kein WebGL 2, das hier nötig ist."],
  unreadable: ["“{name}” is not a picture that this browser reads: give a JPEG, PNG or WebP file.", "„{name}“ ist kein Bild, das dieser Browser liest: Geben Sie eine JPEG-, PNG- oder WebP-Datei an."],

  "lens.title": ["Fig. 1: blur and distance", "Abb. 1: Unschärfe und Entfernung"],
  "lens.what": [
    "A point has the same blur at two distances, one nearer and one farther than the plane of focus. Press a place in the picture to take its distance.<br>Eq. 1: <code>D = F v₀ / (v₀ − F ∓ σ f)</code>, with f = F / (radius of the lens).",
    "Ein Punkt ist in zwei Entfernungen gleich unscharf, vor und hinter der Schärfeebene. Ein Druck auf das Bild übernimmt die Entfernung der Stelle.<br>Gl. 1: <code>D = F v₀ / (v₀ − F ∓ σ f)</code>, mit f = F / (Radius der Linse).",
  ],
  "lens.said": ["Blur radius σ = {sigma} µm on the sensor. Eq. 1 gives {near} (nearer) and {far} (farther).", "Unschärferadius σ = {sigma} µm auf dem Sensor. Gl. 1 ergibt {near} (näher) und {far} (ferner)."],
  none: ["no distance", "keine Entfernung"],
  inFocus: ["in focus", "scharf"],
  sensor: ["sensor", "Sensor"],
  fNumber: ["f-number of the second view", "Blendenzahl des zweiten Bildes"],
  focusDistance: ["focused at", "Scharf eingestellt auf"],
  pointDistance: ["distance of the point", "Entfernung des Punktes"],

  "disparity.title": ["Fig. 5: focal disparity", "Abb. 5: Fokusdisparität"],
  "disparity.what": [
    "The wider aperture loses detail with distance from focus: the ratio of the Laplacians falls from 1 (white), and the table of the optics turns it into depth. Black: too little detail.<br>Eqs. 7–9: <code>ln F₁ − ln F₂ = 2π² λ² (σ₂² − σ₁²)</code>, in the real-time form of section III.",
    "Die weitere Blende verliert mit dem Abstand von der Schärfe an Einzelheiten: Das Verhältnis der Laplace-Werte fällt von 1 (weiß), und die Tabelle der Optik macht daraus Tiefe. Schwarz: zu wenig Einzelheiten.<br>Gl. 7–9: <code>ln F₁ − ln F₂ = 2π² λ² (σ₂² − σ₁²)</code>, in der Echtzeitform von Abschnitt III.",
  ],
  "disparity.said": ["Depth map: yellow near, blue far. The two apertures do not show the side of focus: all is taken to lie on one side.", "Tiefenkarte: gelb nah, blau fern. Zwei Blenden zeigen nicht, auf welcher Seite der Schärfe etwas liegt: Alles gilt als auf einer Seite."],
  "disparity.control": ["Control: both views through the small aperture. The scene is as deep as before, but the ratio is 1 everywhere, and there is no depth.", "Kontrolle: beide Bilder durch die kleine Blende. Die Szene ist so tief wie zuvor, aber das Verhältnis ist überall 1, und es gibt keine Tiefe."],
  "disparity.equal": ["Both apertures are equal: the ratio is 1 everywhere and says nothing about depth.", "Beide Blenden sind gleich: Das Verhältnis ist überall 1 und sagt nichts über die Tiefe."],
  fSmall: ["f-number of the first view", "Blendenzahl des ersten Bildes"],
  fLarge: ["f-number of the second view", "Blendenzahl des zweiten Bildes"],
  focusVergence: ["focus", "Scharfstellung"],
  noise: ["noise (of white)", "Rauschen (von Weiß)"],
  bits: ["bits", "Bits"],
  window: ["window (SD)", "Fenster (SD)"],
  control: ["control: the small aperture twice", "Kontrolle: zweimal die kleine Blende"],
  focalDisparity: ["focal disparity", "Fokusdisparität"],
  depth: ["depth", "Tiefe"],
  trueDepth: ["true depth", "wahre Tiefe"],

  "eye.title": ["The eye: two views at once, and two in time", "Das Auge: zwei Bilder zugleich, und zwei nacheinander"],
  "eye.what": [
    "Blue light is focused nearer than red and green, and the focus oscillates at 2 Hz: either gives two views. The colour of the ratio shows the side: orange where the second view is sharper, blue where the first is.<br>Eq. 11, in vergence: <code>σ₁² − σ₂²</code> is linear in V, so that the side of focus is resolved.",
    "Blaues Licht wird näher fokussiert als rotes und grünes, und die Scharfstellung schwingt mit 2 Hz: Beides gibt zwei Bilder. Die Farbe des Verhältnisses zeigt die Seite: orange, wo das zweite Bild schärfer ist, blau, wo das erste.<br>Gl. 11, in Vergenzen: <code>σ₁² − σ₂²</code> ist linear in V, sodass die Seite der Schärfe feststeht.",
  ],
  "eye.said": ["In focus: {first} at {a} D, {second} at {b} D. A grey scene in daylight; blur is geometric, without diffraction.", "Scharf: {first} bei {a} D, {second} bei {b} D. Eine graue Szene bei Tageslicht; Unschärfe geometrisch, ohne Beugung."],
  pupil: ["pupil", "Pupille"],
  accommodation: ["accommodation", "Akkommodation"],
  sphere: ["prescription: sphere", "Verordnung: Sphäre"],
  cylinder: ["cylinder", "Zylinder"],
  axis: ["axis", "Achse"],
  "axis.180": ["180°", "180°"],
  "axis.90": ["90°", "90°"],
  pair: ["pair of views", "Bildpaar"],
  "pair.bands": ["L+M and S cones", "L+M- und S-Zapfen"],
  "pair.moments": ["L+M cones, 250 ms apart", "L+M-Zapfen, im Abstand von 250 ms"],
  amplitude: ["oscillation (amplitude)", "Schwingung (Amplitude)"],
  moving: ["oscillate at 2 Hz", "mit 2 Hz schwingen"],
  now: ["L+M, now", "L+M, jetzt"],
  before: ["L+M, 250 ms ago", "L+M, vor 250 ms"],
  ratio: ["ratio, second / first", "Verhältnis, zweites / erstes"],

  "rating.title": ["Fig. 3: your own impression of depth", "Abb. 3: Ihr eigener Tiefeneindruck"],
  "rating.what": [
    "Rate eight pictures for depth, then compare: blur behind a near object in focus may add depth, blur in front of a far one may not.<br>Blur grows with aperture as in Eq. 15: <code>r / v = σ / (v₀ − v)</code>. Answers stay in this page until you leave it.",
    "Beurteilen Sie die Tiefe von acht Bildern und vergleichen Sie: Unschärfe hinter einem nahen scharfen Gegenstand kann Tiefe hinzufügen, Unschärfe vor einem fernen nicht.<br>Unschärfe wächst mit der Blende nach Gl. 15: <code>r / v = σ / (v₀ − v)</code>. Antworten bleiben in dieser Seite, bis Sie sie verlassen.",
  ],
  "rating.said": ["Thick: you, one trial each. Dotted: {n} simulated observers with 95 % intervals, computed by a model; no data of people.", "Dick: Sie, je ein Durchgang. Gepunktet: {n} simulierte Beobachter mit 95-%-Intervallen, von einem Modell berechnet; keine Daten von Menschen."],
  rating: ["depth, relative to the standard (1 = equal)", "Tiefe, verglichen mit dem Standard (1 = gleich)"],
  next: ["Continue", "Weiter"],
  again: ["Rate again", "Noch einmal"],
  "look.nearest": ["Picture {n} of {all}. Look at the nearest object, marked at first.", "Bild {n} von {all}. Blicken Sie auf den nächsten Gegenstand, der zuerst markiert ist."],
  "look.farthest": ["Picture {n} of {all}. Look at the farthest object, marked at first.", "Bild {n} von {all}. Blicken Sie auf den fernsten Gegenstand, der zuerst markiert ist."],
  standard: ["standard: depth 1", "Standard: Tiefe 1"],
  picture: ["picture", "Bild"],
  pinhole: ["pinhole", "Lochblende"],
  "key.nearest": ["near object in focus (dotted: simulated)", "naher Gegenstand scharf (gepunktet: simuliert)"],
  "key.farthest": ["far object in focus (dotted: simulated)", "ferner Gegenstand scharf (gepunktet: simuliert)"],

  "own.title": ["Your own light", "Ihr eigenes Licht"],
  "own.what": [
    "Blur a picture of your own by its depth map, or compare two photographs from a tripod that differ in aperture or focus. Files stay in this browser.<br>Eq. 16 in vergence: <code>V = V_f ∓ σ / (v₀ A/2)</code>; the ratio as in Fig. 5.",
    "Zeichnen Sie ein eigenes Bild nach seiner Tiefenkarte unscharf, oder vergleichen Sie zwei Fotos vom Stativ mit verschiedener Blende oder Scharfstellung. Dateien bleiben in diesem Browser.<br>Gl. 16 in Vergenzen: <code>V = V_f ∓ σ / (v₀ A/2)</code>; das Verhältnis wie in Abb. 5.",
  ],
  mode: ["what to use", "Was verwendet wird"],
  "mode.depth": ["picture and depth map", "Bild und Tiefenkarte"],
  "mode.photographs": ["two photographs", "zwei Fotos"],
  depthMap: ["depth map (grey is linear in 1/distance)", "Tiefenkarte (Grau ist linear in 1/Entfernung)"],
  photograph1: ["first photograph", "erstes Foto"],
  photograph2: ["second photograph", "zweites Foto"],
  white: ["white is", "Weiß ist"],
  "white.near": ["near", "nah"],
  "white.far": ["far", "fern"],
  near: ["nearest distance (m)", "kleinste Entfernung (m)"],
  far: ["farthest distance (m)", "größte Entfernung (m)"],
  fieldDegrees: ["width of the picture (degrees)", "Breite des Bildes (Grad)"],
  aperture: ["aperture", "Blendendurchmesser"],
  ownFocus: ["focused at", "Scharf eingestellt auf"],
  f1: ["f-number of the first", "Blendenzahl des ersten"],
  f2: ["f-number of the second", "Blendenzahl des zweiten"],
  focus1: ["focus of the first (m)", "Schärfe des ersten (m)"],
  focus2: ["focus of the second (m)", "Schärfe des zweiten (m)"],
  blurred: ["blurred", "unscharf"],
  "own.example": ["Until you choose files, this is the scene of the other panels.", "Bis Sie Dateien wählen, ist dies die Szene der anderen Tafeln."],
  "own.here": ["Your picture, in grey, at no more than 640 pixels.", "Ihr Bild, in Grau, mit höchstens 640 Bildpunkten."],
  "own.equal": ["Aperture and focus are equal: the ratio says nothing about depth.", "Blende und Scharfstellung sind gleich: Das Verhältnis sagt nichts über die Tiefe."],
  "own.apertures": ["Smaller aperture first. White: in focus; the darker the blue, the farther from focus, on either side.", "Kleinere Blende zuerst. Weiß: scharf; je dunkler das Blau, desto weiter von der Schärfe, auf beiden Seiten."],
  "own.foci": ["Nearer focus first. Blue: near; orange: far; white: in between, or too far from both.", "Nähere Scharfstellung zuerst. Blau: nah; orange: fern; weiß: dazwischen, oder weit von beiden."],
};
