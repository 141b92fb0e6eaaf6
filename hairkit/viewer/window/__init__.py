"""The window of the viewer: GLFW, input events, option panel and text overlay.

It passes events to the actions and shows the frames that the preview draws.

* `file_watcher`: detects changed files
* `gl_context`: a window with an OpenGL context
* `hud`: text overlay
* `keyboard`: names of keys
* `mouse`: mouse events to actions
* `panel`: the option panel, if imgui-bundle is installed
* `splash`: the wait screen until the first frame
* `stillness`: when the window sleeps
* `window`: the main loop
"""
