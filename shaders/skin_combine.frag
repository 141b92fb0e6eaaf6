#version 430
// The layers together, at the depth of the surface.
#include "tone.glsl"

uniform sampler2D u_diffuse;
uniform sampler2D u_surface;
uniform sampler2D u_specular;   // and the depth of OpenGL, 0 where nothing is
out vec4 out_colour;

void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    vec4 specular = texelFetch(u_specular, here, 0);
    if (specular.a == 0.0) discard;
    vec3 flesh = texelFetch(u_diffuse, here, 0).rgb * texelFetch(u_surface, here, 0).rgb;
    out_colour = vec4(tone(flesh + specular.rgb), 1.0);
    gl_FragDepth = specular.a;
}
