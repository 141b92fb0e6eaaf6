#version 430
// The drawn picture, top row first, with the text over it.

uniform sampler2D u_picture;
uniform sampler2D u_text;
uniform vec2 u_size;

out vec4 out_colour;

void main() {
    vec2 place = gl_FragCoord.xy / u_size;
    place.y = 1.0 - place.y;
    vec4 text = texture(u_text, place);
    out_colour = vec4(mix(texture(u_picture, place).rgb, text.rgb, text.a), 1.0);
}
