// From linear radiance to sRGB: Narkowicz's fit of the ACES film curve, then the sRGB curve.

uniform float u_exposure;

#constants hairkit.rendering.fibre FILM

vec3 tone(vec3 linear_rgb) {
    vec3 x = linear_rgb * u_exposure;
    vec3 film = clamp(x * (FILM[0] * x + FILM[1]) / (x * (FILM[2] * x + FILM[3]) + FILM[4]), 0.0, 1.0);
    return mix(12.92 * film, 1.055 * pow(film, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, film));
}
