#version 430
#include "skin.glsl"
#include "albedo.glsl"
#include "skin_maps.glsl"

in vec3 v_position;
in vec3 v_normal;
in vec3 v_albedo;
in vec2 v_uv;
out vec4 out_colour;

void main() {
    vec3 normal = normalize(v_normal);
    normal *= gl_FrontFacing ? -1.0 : 1.0;   // pictures are drawn upside down, which swaps the winding
    normal = mapped_normal(normal, v_position, v_uv);
    Layers layers = skin_layers(v_position, normal, mapped_roughness(u_roughness, v_uv));
    vec3 albedo = v_albedo * picture(v_uv);
    out_colour = vec4(tone(albedo * layers.diffuse + layers.specular), 1.0);
}
