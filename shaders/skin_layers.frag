#version 430
// The layers of skin apart, so that the light in the flesh can be diffused over the picture.
#include "skin.glsl"
#include "albedo.glsl"
#include "skin_maps.glsl"

in vec3 v_position;
in vec3 v_normal;
in vec3 v_albedo;
in vec2 v_uv;
layout(location = 0) out vec4 out_diffuse;    // and the depth, metres
layout(location = 1) out vec4 out_albedo;     // and whether it scatters
layout(location = 2) out vec4 out_specular;   // and the depth of OpenGL

void main() {
    vec3 normal = normalize(v_normal);
    normal *= gl_FrontFacing ? -1.0 : 1.0;
    normal = mapped_normal(normal, v_position, v_uv);
    Layers layers = skin_layers(v_position, normal, mapped_roughness(u_roughness, v_uv));
    float away = dot(v_position - u_eye, u_forward);
    out_diffuse = vec4(layers.diffuse, away);
    out_albedo = vec4(v_albedo * picture(v_uv), u_scatter);
    out_specular = vec4(layers.specular, max(gl_FragCoord.z, 1e-7));
}
