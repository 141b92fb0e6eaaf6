#version 430
// Toned skin, without the powers of tone.glsl and albedo.glsl, which take software renderers as long
// as all the rest: a cubic and square roots, off by less than a 256th (Chilliant 2012, "sRGB
// approximations for HLSL").

uniform sampler2D u_albedo;
uniform float u_textured;
uniform float u_exposure;

in vec3 v_light;
in vec3 v_specular;
in vec2 v_uv;
out vec4 out_colour;

vec3 quickly_linear(vec3 srgb) {
    return srgb * (srgb * (srgb * 0.305306011 + 0.682171111) + 0.012522878);
}

vec3 quickly_toned(vec3 x) {
    vec3 film = clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
    vec3 a = sqrt(film), b = sqrt(a), c = sqrt(b);
    return 0.662002687 * a + 0.684122060 * b - 0.323583601 * c - 0.0225411470 * film;
}

void main() {
    if (u_textured < 0.5) {
        out_colour = vec4(v_light, 1.0);
        return;
    }
    vec3 flesh = v_light * quickly_linear(texture(u_albedo, v_uv).rgb);
    out_colour = vec4(quickly_toned(u_exposure * (flesh + v_specular)), 1.0);
}
