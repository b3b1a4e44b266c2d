# For the module, and for apps/sar_recognise where it is a project of its own.
set(recognise_sources cell.cpp classifier.cpp networks.cpp)
